"""Processes that run at the same time and share a file: one of them makes it, the others wait."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

EXPIRY = 60.0  # [s] without a sign of life after which a holder on another machine counts as dead


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep other processes out of a block while it runs, on this machine and on others that share the file system.

    The lock is a file that is created exclusively, which network file systems do atomically as well, and removed at
    the end. A holder that was killed holds nobody up: its own machine misses it at once, others after `EXPIRY`.

    Args:
        path: The lock, in a folder that is made where it does not exist.
    """
    from filelock import SoftFileLease

    path.parent.mkdir(parents=True, exist_ok=True)
    with SoftFileLease(path, lease_duration=EXPIRY, poll_interval=0.2):
        yield
