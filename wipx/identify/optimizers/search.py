"""What all optimizers share: budget, history, progress reports and cancellation."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from wipx.core.results import SearchHistory
from wipx.identify.problem import Problem

POINTS = 2000  # of a history, at most
HOPELESS = 1e30  # loss that a method is told where there is none

Start = Literal["random", "model"]


class BudgetSpentError(Exception):
    """Ends a search from inside a library's loop; the best point so far is the result."""


class Watcher(Protocol):
    """Sees the progress of a search; raises KeyboardInterrupt to cancel it."""

    def __call__(self, progress: "Progress") -> None:
        """Called after every batch of evaluations."""
        ...


@dataclass(frozen=True)
class Progress:
    """Where a search is.

    Attributes:
        evaluations: Loss evaluations so far.
        seconds: Time so far [s].
        best_loss: Lowest loss so far.
        share: Part of the search that is done, 0 to 1; later parts may be quicker or slower.
    """

    evaluations: int
    seconds: float
    best_loss: float
    share: float


def unwatched(progress: Progress) -> None:
    """Do not report progress."""


@dataclass(frozen=True)
class Minimum:
    """Result of a search.

    Attributes:
        cube: Best position in the unit cube, shape (D,).
        loss: Its loss.
        history: How it came about.
        failed: Evaluations in which every prediction diverged.
    """

    cube: np.ndarray
    loss: float
    history: SearchHistory
    failed: int


class Optimizer(Protocol):
    """A way to search the unit cube."""

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best position found within the budget; the same for the same generator state."""
        ...


@dataclass
class Log:
    """Counts evaluations and keeps the best position of one search.

    Attributes:
        optimizer: Name of the method.
        evaluations: Budget.
        seconds: Budget [s].
        watcher: Called after every batch.
        share: Part of the search that is done: of the budget, or more where the optimizer knows better.
    """

    optimizer: str
    evaluations: int
    seconds: float
    watcher: Watcher
    share: float = 0.0
    began: float = field(default_factory=time.monotonic)
    count: int = 0
    failed: int = 0
    best_loss: float = np.inf
    best: np.ndarray | None = None
    course: list[tuple[int, float, float]] = field(default_factory=list)
    calls: int = 0
    stride: int = 1  # calls per point of the course; doubled where it would grow too long

    def evaluate(self, problem: Problem, cube: np.ndarray) -> np.ndarray:
        """Losses (P,) of positions (P, D), computed in one call and noted; never more than the budget allows.

        A position without a finite loss gets a finite one that is larger than all others, because some methods cannot
        handle infinity.

        Raises:
            BudgetSpentError: the budget of evaluations or seconds is used up.
        """
        allowed = cube[: max(self.evaluations - self.count, 1)]
        losses = np.asarray(problem.losses(allowed), dtype=float)
        self.add(allowed, losses)
        return np.where(np.isfinite(losses), losses, HOPELESS)

    def add(self, cube: np.ndarray, losses: np.ndarray) -> None:
        """Note the losses (P,) of positions (P, D).

        Raises:
            BudgetSpentError: the budget of evaluations or seconds is used up.
        """
        self.failed += int(np.sum(~np.isfinite(losses)))
        finite = np.where(np.isfinite(losses), losses, np.inf)
        i = int(np.argmin(finite))
        if finite[i] < self.best_loss or self.best is None:
            self.best_loss, self.best = float(finite[i]), np.array(cube[i])
        self.tick(len(losses))

    def tick(self, evaluations: int) -> None:
        """Count evaluations whose losses do not compare with the others.

        Raises:
            BudgetSpentError: as `add`.
        """
        self.count += evaluations
        spent = time.monotonic() - self.began
        if self.calls % self.stride == 0:
            self.course.append((self.count, spent, self.best_loss))
        self.calls += 1
        if len(self.course) == POINTS:
            self.course, self.stride = self.course[::2], 2 * self.stride
        self.share = min(max(self.share, self.count / self.evaluations, spent / self.seconds), 1.0)
        self.watcher(Progress(self.count, spent, self.best_loss, self.share))
        if self.count >= self.evaluations or spent >= self.seconds:
            raise BudgetSpentError

    def minimum(self, stopped: str) -> Minimum:
        """The result so far."""
        if self.best is None:
            raise ValueError("a search needs at least one evaluation")
        course = np.array([*self.course, (self.count, time.monotonic() - self.began, self.best_loss)])
        history = SearchHistory(self.optimizer, course[:, 0].astype(int), course[:, 1], course[:, 2], stopped)
        return Minimum(self.best, self.best_loss, history, self.failed)

    def spent(self) -> str:
        """Which budget ended the search."""
        if self.count >= self.evaluations:
            return f"budget of {self.evaluations} evaluations"
        return f"budget of {self.seconds:g} s"


def first_position(problem: Problem, start: Start, rng: np.random.Generator) -> np.ndarray:
    """Where a search begins, shape (D,): drawn evenly from the cube, or the model's own start."""
    return problem.space.start if start == "model" else rng.random(len(problem.space.free))


@contextmanager
def own_randomness(rng: np.random.Generator) -> Iterator[int]:
    """A seed for a library that draws from numpy's global state, which is put back afterwards."""
    state = np.random.get_state()
    seed = int(rng.integers(1, 2**31))
    np.random.seed(seed)
    try:
        yield seed
    finally:
        np.random.set_state(state)
