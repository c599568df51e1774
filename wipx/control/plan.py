"""What a model predictive controller knows beforehand: how moves change states and cost over its horizon.

The moves are corrections v of a state feedback, u_i = -K_i y_i + v_i (pre-stabilised predictions: Rossiter,
Kouvaritakis and Rice 1998, A numerically robust state-space approach to stable-predictive control strategies,
Automatica 34(1)). With the gains K_i of the finite-horizon Riccati recursion the cost is the sum of w_i v_i^2: where no
limit acts v = 0 is the optimum, and a quadratic programme stays well conditioned although the plant is not stable.
"""

from dataclasses import dataclass

import numpy as np

from wipx.control.linearise import LinearModel


@dataclass(frozen=True)
class Plan:
    """Predictions over N intervals; one command.

    Attributes:
        gains: Of the first interval, K_0, shape (1, states).
        weights: w_i of the cost, shape (N,).
        commands_by_state: Slope of every command by the state at the start, shape (N, states).
        commands_by_moves: By the moves, shape (N, N).
        states_by_state: Slope of the state at every interval's end, shape (N, states, states).
        states_by_moves: By the moves, shape (N, states, N).
    """

    gains: np.ndarray
    weights: np.ndarray
    commands_by_state: np.ndarray
    commands_by_moves: np.ndarray
    states_by_state: np.ndarray
    states_by_moves: np.ndarray

    @classmethod
    def of(cls, linear: LinearModel, q: np.ndarray, r: np.ndarray, intervals: np.ndarray) -> "Plan":
        """The plan with the cost of a linear quadratic regulator, which is also what comes after the horizon.

        Args:
            linear: The plant, with one command.
            q: Weights of the states, shape (states, states).
            r: Weight of the command, shape (1, 1).
            intervals: For which each move is held, shape (N,) [s].

        Raises:
            LinAlgError: no gains stabilise the plant.
        """
        from scipy.linalg import solve_continuous_are

        steps = [_sampled(linear, q, r, interval) for interval in intervals]
        to_come = solve_continuous_are(linear.a, linear.b, q, r)
        gains, weights = [], []
        for step in reversed(steps):
            w = step.r + step.b.T @ to_come @ step.b
            cross = step.b.T @ to_come @ step.a + step.s.T
            k = np.linalg.solve(w, cross)
            to_come = step.q + step.a.T @ to_come @ step.a - cross.T @ k
            gains.append(k)
            weights.append(w[0, 0])
        gains.reverse()
        count, states = len(intervals), len(linear.a)
        by_state, by_moves = np.eye(states), np.zeros((states, count))
        commands_by_state, commands_by_moves = np.empty((count, states)), np.empty((count, count))
        states_by_state, states_by_moves = np.empty((count, states, states)), np.empty((count, states, count))
        for i, (step, k) in enumerate(zip(steps, gains, strict=True)):
            commands_by_state[i] = -k[0] @ by_state
            commands_by_moves[i] = -k[0] @ by_moves
            commands_by_moves[i, i] += 1.0
            by_state = step.a @ by_state + step.b @ commands_by_state[i][None]
            by_moves = step.a @ by_moves + step.b @ commands_by_moves[i][None]
            states_by_state[i], states_by_moves[i] = by_state, by_moves
        return cls(
            gains[0],
            np.array(weights[::-1]),
            commands_by_state,
            commands_by_moves,
            states_by_state,
            states_by_moves,
        )


@dataclass(frozen=True)
class _Sampled:
    """One interval: y+ = A y + B u at the cost y'Qy + 2 y'S u + u'Ru."""

    a: np.ndarray
    b: np.ndarray
    q: np.ndarray
    s: np.ndarray
    r: np.ndarray


def _sampled(linear: LinearModel, q: np.ndarray, r: np.ndarray, interval: float) -> _Sampled:
    """Exact sampling of plant and cost under a held command (Van Loan 1978, IEEE TAC 23(3))."""
    from scipy.linalg import block_diag, expm

    states, size = len(linear.a), len(linear.a) + linear.b.shape[1]
    both = np.zeros((size, size))
    both[:states, :states], both[:states, states:] = linear.a, linear.b
    moved = expm(interval * np.block([[-both.T, block_diag(q, r)], [np.zeros((size, size)), both]]))
    ahead = moved[size:, size:]
    cost = ahead.T @ moved[:size, size:]
    return _Sampled(
        ahead[:states, :states],
        ahead[:states, states:],
        cost[:states, :states],
        cost[:states, states:],
        cost[states:, states:],
    )


def growing_intervals(first: float, horizon: float, count: int) -> np.ndarray:
    """Intervals that grow by a constant factor from `first` and add up to `horizon` [s], shape (count,)."""
    from scipy.optimize import root_scalar

    powers = np.arange(count)
    largest = (horizon / first) ** (1.0 / (count - 1))
    growth = root_scalar(lambda factor: first * np.sum(factor**powers) - horizon, bracket=(1.0, largest)).root
    return first * growth**powers
