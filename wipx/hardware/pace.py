"""Running at a rate: absolute deadlines, no garbage collection, and the scheduler's priority where it is granted."""

import gc
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from math import ceil

SPIN = (
    4e-4  # [s] before a deadline that are spun instead of slept: a sleep ends up to this much late on an idle machine
)


class Pace:
    """Deadlines at multiples of a period; what is missed is skipped, not caught up with.

    Args:
        rate: [Hz].

    Attributes:
        overruns: When a step ended so late that others were skipped [s], and how many.
    """

    def __init__(self, rate: float) -> None:
        self.overruns: list[tuple[float, int]] = []
        self._period = 1.0 / rate
        self._next = 0.0

    def begin(self) -> float:
        """The first step is now; returns the time [s]."""
        self._next = time.perf_counter()
        return self._next

    def wait(self) -> float:
        """Wait for the next step; returns the time [s]."""
        self._next += self._period
        ended = time.perf_counter()
        late = ended - self._next
        if late > 0.5 * self._period:
            missed = ceil(late / self._period)
            self._next += missed * self._period
            self.overruns.append((ended, missed))
        asleep = self._next - time.perf_counter() - SPIN
        if asleep > 0.0:
            time.sleep(asleep)
        while (now := time.perf_counter()) < self._next:
            pass
        return now


@contextmanager
def undisturbed(priority: int) -> Iterator[None]:
    """Without garbage collection, and scheduled first in, first out.

    Args:
        priority: Of SCHED_FIFO, 1 to 99; 0 leaves the scheduler as it is. Where it is not granted a line says so.
    """
    collecting = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    before = _scheduled_first(priority) if priority else None
    try:
        yield
    finally:
        if before is not None:
            os.sched_setscheduler(0, *before)
        gc.unfreeze()
        if collecting:
            gc.enable()


def _scheduled_first(priority: int) -> tuple[int, os.sched_param] | None:
    """How the process was scheduled before; None where the priority is not granted."""
    if sys.platform != "linux":
        _refused(priority, "only Linux has it")
        return None
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        _refused(priority, str(error.strerror))
        return None
    return before


@cache
def _refused(priority: int, reason: str) -> None:
    """Say it once, not before every trial."""
    remedy = "grant it (docs/hardware.md) or set target.priority=0"
    print(f"target.priority={priority} is refused ({reason}), trials run without it; {remedy}", file=sys.stderr)
