"""Held-out recordings: how a set is divided into what a model is fitted to and what judges it."""

from fnmatch import fnmatch

from wipx.core.errors import InputError
from wipx.core.recording import Recording, RecordingSplit

EVERY = 3  # of many recordings, every third is held out
LAST_SHARE = 0.3  # of few recordings, the last 30 % of the time
FEWEST_ROWS = 3  # a rate and its change need three samples


def split_recordings(recordings: tuple[Recording, ...], held_out: str | float | list[str]) -> RecordingSplit:
    """Divide recordings into those to fit and those held out.

    Args:
        recordings: At least one.
        held_out: "auto" (every third of three or more recordings, else the last 30 % of each one's
            time), the last share of each one's time, or patterns of file names.

    Raises:
        InputError: the setting is none of these, a pattern matches no recording, or nothing or
            too little is left on one side.
    """
    if held_out == "auto":
        if len(recordings) < EVERY:
            return _by_time(recordings, LAST_SHARE)
        chosen = {recording.name for recording in recordings[EVERY - 1 :: EVERY]}
        return _by_name(recordings, chosen, "every third recording is held out")
    if isinstance(held_out, list | tuple) and held_out and all(isinstance(p, str) for p in held_out):
        return _by_name(recordings, _matching(recordings, held_out), "named recordings are held out")
    if isinstance(held_out, float) and 0.0 < held_out < 1.0:
        return _by_time(recordings, held_out)
    raise InputError(
        f"recordings.held_out is {held_out!r}, expected auto, a share of the time such as 0.3, or file patterns"
    )


def _matching(recordings: tuple[Recording, ...], patterns: list[str]) -> set[str]:
    names = [recording.name for recording in recordings]
    for pattern in patterns:
        if not any(fnmatch(name, pattern) for name in names):
            raise InputError(f"recordings.held_out: {pattern} matches none of {', '.join(names)}; correct the pattern")
    return {name for name in names if any(fnmatch(name, pattern) for pattern in patterns)}


def _by_name(recordings: tuple[Recording, ...], chosen: set[str], rule: str) -> RecordingSplit:
    fit = tuple(recording for recording in recordings if recording.name not in chosen)
    held = tuple(recording for recording in recordings if recording.name in chosen)
    return RecordingSplit(fit, held, f"{rule}: {', '.join(recording.name for recording in held)}")


def _by_time(recordings: tuple[Recording, ...], share: float) -> RecordingSplit:
    cuts = [float(r.t[0]) + (1.0 - share) * r.duration for r in recordings]
    fit = tuple(r.between(float("-inf"), cut) for r, cut in zip(recordings, cuts, strict=True))
    held = tuple(r.between(cut, float("inf")) for r, cut in zip(recordings, cuts, strict=True))
    for part in (*fit, *held):
        if len(part) < FEWEST_ROWS:
            raise InputError(
                f"{part.source}: {len(part)} rows on one side of the cut at {1.0 - share:.0%} of its time, "
                f"expected {FEWEST_ROWS}; change recordings.held_out or leave the file out"
            )
    return RecordingSplit(fit, held, f"the last {share:.0%} of each recording's time is held out")
