"""One clock for all streams: which stamps count, how the two kinds of them differ, and the rows in their order."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError
from wipx.core.log_preview import StampDifference
from wipx.importing.log_format import NO_STAMP
from wipx.importing.spool import StoredStream

SAME_CLOCK = 1.0  # [s] that header and receive stamps may differ by on one clock: transport takes milliseconds
SET_BACK = 0.5  # [s] by which stamps step back where a clock was set back, and not only messages overtook each other
MOST = 0.5  # share of the messages that must have a stamp for it to count


@dataclass(frozen=True)
class Clock:
    """Which stamps count of every stream that is used.

    Attributes:
        of: "header" or "receive", by stream.
        note: Why, where it is not what one would expect; "" else.
    """

    of: Mapping[str, str]
    note: str = ""

    def stamps(self, stream: StoredStream, begin: int = 0, end: int | None = None) -> np.ndarray:
        """The stamps that count of rows begin <= k < end, shape (end - begin,) [ns]."""
        return stream.header(begin, end) if self.of[stream.name] == "header" else stream.receive(begin, end)


@dataclass(frozen=True)
class OrderedRows:
    """The messages of a stream in an episode, in the order of their stamps.

    Attributes:
        rows: Their numbers in the episode, shape (n,).
        stamps: Strictly increasing, shape (n,) [ns].
        duplicates: Messages that are left out, for they have the stamp of another one.
        out_of_order: Messages that came after a later one.
        unstamped: Messages that are left out, for they have no stamp.
    """

    rows: np.ndarray
    stamps: np.ndarray
    duplicates: int
    out_of_order: int
    unstamped: int


def choose_clock(streams: Sequence[StoredStream], wish: str) -> Clock:
    """The stamps that count.

    Args:
        streams: Those that are used.
        wish: "auto", "header" or "receive".

    Raises:
        InputError: a stream lacks the stamps that were asked for, or the stamps are of different clocks.
    """
    header = {s.name: _share(s.header()) > MOST for s in streams}
    receive = {s.name: _share(s.receive()) > MOST for s in streams}
    for stream in streams:
        if not (header[stream.name] or receive[stream.name]):
            raise InputError(
                f"{stream.name}: its messages have no stamps; record it with a time, or give log.format.period"
            )
    if wish == "receive":
        lacking = [name for name in receive if not receive[name]]
        if lacking:
            raise InputError(f"log.clock=receive: {lacking[0]} has no receive stamps; use log.clock=header")
        return Clock(dict.fromkeys(receive, "receive"))
    of = {name: "header" if header[name] else "receive" for name in header}
    reason = _of_two_clocks(streams, of)
    if not reason:
        return Clock(of)
    if wish == "auto" and all(receive.values()):
        return Clock(dict.fromkeys(of, "receive"), f"receive stamps count, since {reason}")
    remedy = "use log.clock=receive" if all(receive.values()) else "record all streams with stamps of one clock"
    raise InputError(f"mixed clocks: {reason}; {remedy}")


def ordered(stamps: np.ndarray) -> OrderedRows:
    """The messages with a stamp in the order of their stamps, the first of those with the same one.

    Args:
        stamps: As they came, shape (rows,) [ns].
    """
    rows = np.flatnonzero(stamps != NO_STAMP)
    kept = stamps[rows]
    late = int(np.count_nonzero(kept < np.maximum.accumulate(kept))) if len(kept) else 0
    if late:
        order = np.argsort(kept, kind="stable")
        rows, kept = rows[order], kept[order]
    first = np.ones(len(kept), dtype=bool)
    first[1:] = np.diff(kept) > 0
    return OrderedRows(rows[first], kept[first], int(np.count_nonzero(~first)), late, len(stamps) - len(first))


def check_not_set_back(stamps: np.ndarray, stream: str, which: str) -> None:
    """Refuse a clock that was set back while it stamped messages of several streams.

    Args:
        stamps: As they came, shape (rows,) [ns].
        stream: Their stream.
        which: "header" or "receive".

    Raises:
        InputError: see above.
    """
    steps = set_back(stamps)
    if len(steps):
        row = int(steps[0])
        by = (stamps[row - 1] - stamps[row]) / 1e9
        remedy = "use log.clock=receive" if which == "header" else "cut the log there"
        raise InputError(
            f"{stream}: mixed clocks: its {which} stamps go back by {by:.3g} s at message {row + 1}; {remedy}"
        )


def set_back(stamps: np.ndarray) -> np.ndarray:
    """Rows before which a clock was set back, shape (times,).

    Args:
        stamps: As they came, shape (rows,) [ns].
    """
    known = np.flatnonzero(stamps != NO_STAMP)
    return known[1:][np.diff(stamps[known]) < -SET_BACK * 1e9]


def difference(stream: StoredStream) -> StampDifference | None:
    """Receive against header stamps; None where a stream lacks one of them."""
    header, receive = stream.header(), stream.receive()
    both = (header != NO_STAMP) & (receive != NO_STAMP)
    if np.count_nonzero(both) < 2:
        return None
    header, delay = header[both], (receive[both] - header[both]) / 1e9
    t = (header - header[0]) / 1e9
    # A slope through medians of ten parts: single late messages do not count.
    parts = [k for k in np.array_split(np.arange(len(t)), 10) if len(k)]
    middle, level = (np.array([np.median(v[k]) for k in parts]) for v in (t, delay))
    spread = float(np.ptp(middle))
    drift = float(np.polyfit(middle - middle.mean(), level, 1)[0]) if spread > 0.0 else 0.0
    low, median, high = np.percentile(delay, (5.0, 50.0, 95.0))
    return StampDifference(float(median), float(low), float(high), drift)


def _share(stamps: np.ndarray) -> float:
    return float(np.count_nonzero(stamps != NO_STAMP)) / max(len(stamps), 1)


def _of_two_clocks(streams: Sequence[StoredStream], of: Mapping[str, str]) -> str:
    """What shows that the chosen stamps are of different clocks; "" where nothing does."""
    by_receive = [s for s in streams if of[s.name] == "receive"]
    for stream in streams if by_receive else ():
        delay = difference(stream) if of[stream.name] == "header" else None
        if delay is not None and abs(delay.median) > SAME_CLOCK:
            return (
                f"{stream.name} is received {delay.median:.4g} s after its header stamps, "
                f"and {by_receive[0].name} has no header stamps"
            )
    spans = {}
    for stream in streams:
        stamps = stream.header() if of[stream.name] == "header" else stream.receive()
        known = stamps[stamps != NO_STAMP]
        spans[stream.name] = int(known.min()), int(known.max())
    for one in spans:
        for other in spans:
            if spans[other][0] > spans[one][1]:
                gap = (spans[other][0] - spans[one][1]) / 1e9
                return f"the {of[other]} stamps of {other} begin {gap:.4g} s after the {of[one]} stamps of {one} end"
    return ""
