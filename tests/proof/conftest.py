"""The program as a user calls it, for the proofs."""

from tasks.conftest import folder, program

__all__ = ["folder", "program"]
