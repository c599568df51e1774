"""The program as a user calls it, for the proofs."""

from tasks.conftest import program

__all__ = ["program"]
