"""Effects that act on robots from a model file otherwise than on the other plants; contract section 6."""
