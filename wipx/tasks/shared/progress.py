"""Progress on the terminal: a bar with the time left."""

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Self

from tqdm import tqdm

if TYPE_CHECKING:
    from wipx.identify.optimizers.search import Progress


class _Bar:
    """A bar with the time left, on a terminal only."""

    def __init__(self, label: str) -> None:
        self._bar = tqdm(
            total=100,
            desc=label,
            bar_format="{desc} |{bar:24}| {percentage:3.0f} %, {elapsed} elapsed, about {remaining} left{postfix}",
            file=sys.stderr,
            leave=False,
            disable=None,
        )

    def show(self, share: float, text: str) -> None:
        """Show what share is done; a share that falls begins the bar anew."""
        done = min(int(100.0 * share), 100)
        if done < self._bar.n:
            self._bar.reset()
        self._bar.n = done
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.close()


class SearchProgress(_Bar):
    """A bar over the parts of a search; used as its watcher.

    A search that is made once more, with other weights, begins the bar anew.
    """

    def __init__(self, label: str = "identify") -> None:
        super().__init__(label)

    def __call__(self, progress: "Progress") -> None:
        """Show where the search is."""
        self.show(progress.share, f"loss {progress.best_loss:.4g}, {progress.evaluations} evaluations")


class StageProgress(_Bar):
    """A bar over the stages of a task; used as its watcher."""

    def __call__(self, stage: str, share: float) -> None:
        """Show which stage is at work."""
        self.show(share, stage)
