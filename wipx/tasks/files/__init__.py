"""The files that tasks leave, all of them or none, and how a rerun finds them."""
