"""Progress on the terminal: a bar with the time left."""

import sys
from types import TracebackType

from tqdm import tqdm

from wipx.identify.optimizers.search import Progress


class SearchProgress:
    """A bar over the parts of a search; used as its watcher.

    A search that is made once more, with other weights, begins the bar anew.
    """

    def __init__(self, label: str = "identify") -> None:
        self._bar = tqdm(
            total=100,
            desc=label,
            bar_format="{desc} |{bar:24}| {percentage:3.0f} %, {elapsed} gone, about {remaining} left{postfix}",
            file=sys.stderr,
            leave=False,
            disable=None,
        )

    def __call__(self, progress: Progress) -> None:
        """Show where the search is."""
        done = min(int(100.0 * progress.share), 100)
        if done < self._bar.n:
            self._bar.reset()
        self._bar.n = done
        self._bar.set_postfix_str(f"loss {progress.best_loss:.4g}, {progress.evaluations} evaluations", refresh=False)
        self._bar.update(0)

    def __enter__(self) -> "SearchProgress":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.close()
