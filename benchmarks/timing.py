"""Fair timing on a machine that others use too: processor time, interleaved rounds, medians."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Timing:
    """Processor time of one call.

    Attributes:
        median: Over the rounds [s].
        low: Of the fastest round [s].
        high: Of the slowest round [s].
    """

    median: float
    low: float
    high: float


def interleaved(variants: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, Timing]:
    """Time variants in turn, so that a disturbance falls on all of them alike.

    Args:
        variants: What to call, by name.
        rounds: How often each is timed, after one call that is not.
    """
    for call in variants.values():
        call()
    spent: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(rounds):
        for name, call in variants.items():
            spent[name].append(processor_time(call))
    return {name: Timing(float(np.median(s)), min(s), max(s)) for name, s in spent.items()}


def processor_time(call: Callable[[], object]) -> float:
    """Processor time of this process during one call [s]."""
    began = time.process_time()
    call()
    return time.process_time() - began


def print_table(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Print rows of text in columns, the first left-aligned and the others right-aligned."""
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    print(f"\n{title}")
    for row in [header, *rows]:
        cells = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        print("  ".join([row[0].ljust(widths[0]), *cells]), flush=True)
