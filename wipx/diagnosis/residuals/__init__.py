"""What a fit leaves over: tests for forces of any shape, and what stands in for them."""
