"""Progress on the terminal: a bar with the time left."""

import sys
from types import TracebackType

from tqdm import tqdm


class SearchProgress:
    """A bar over the budget of a search; used as its watcher.

    The bar shows the time left of the budget; most searches converge before it is used up.
    """

    def __init__(self, seconds: float, label: str = "identify") -> None:
        self._bar = tqdm(
            total=round(seconds, 1),
            desc=label,
            unit="s",
            bar_format="{desc}: {elapsed} of at most {total_fmt} s |{bar:20}| {postfix}",
            file=sys.stderr,
            leave=False,
            disable=None,
        )

    def __call__(self, evaluations: int, seconds: float, best_loss: float) -> None:
        """Show where the search is."""
        self._bar.n = min(seconds, self._bar.total or seconds)
        left = max((self._bar.total or 0.0) - seconds, 0.0)
        self._bar.set_postfix_str(
            f"{evaluations} evaluations, loss {best_loss:.4g}, at most {left:.0f} s left", refresh=False
        )
        self._bar.update(0)

    def __enter__(self) -> "SearchProgress":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.close()
