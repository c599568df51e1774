"""Linear model predictive control: the regulator that knows the limits of force, rail and pitch.

Rawlings, Mayne and Diehl 2017, Model Predictive Control, ch. 1; solved by OSQP (Stellato et al. 2020, Math.
Prog. Comp. 12).
"""

from dataclasses import dataclass, replace
from math import isfinite
from time import perf_counter
from typing import Self

import numpy as np

from wipx.control.balance_watch import BalanceWatch, check_carriage
from wipx.control.controller import PitchEstimator
from wipx.control.cost import QuadraticCost
from wipx.control.ekf import Ekf
from wipx.control.filtered_loop import FilteredLoop
from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise
from wipx.control.plan import Plan, growing_intervals
from wipx.control.sampled import check_stabilises
from wipx.control.soft_update import SoftUpdate
from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model

TOLERANCE = 1e-4  # of the solver, in newtons, metres and radians; a CAN frame's step of force is 0.09 N
ITERATIONS = 400  # at most; one is about 6 us
SOFTNESS = np.array([1e6, 1e6])  # cost of a square metre and radian beyond limits; a whole fall costs some hundreds
WITHIN = 0.95  # share of a rail within which it plans to stay
ALPHA, BETA = 0.02, 1.0  # of the reference that follows a balance, as in Eq. 9: within some 0.1 s


@dataclass(frozen=True)
class Mpc(QuadraticCost):
    """Minimises the cost of `QuadraticCost` over a horizon, within limits, at every step.

    Moves are held for intervals that grow from one period on, so that the first is as fine as the loop and few reach
    far. Beyond the horizon comes the cost of the regulator without limits. Limits of the state are soft: where they
    cannot be kept they are violated as little as possible; that of the force is hard.

    Attributes:
        horizon: [s].
        moves: Intervals of the horizon.
        rail: Largest distance from x = 0 [m].
        lean: Largest pitch [rad].
        offset_free: Time over which the pitch of balance is estimated, continuously, and about which the plan is made
            [s]; None for the nominal balance, which leaves a standing error of the position under a load.
    """

    horizon: float = 1.5
    moves: int = 20
    rail: float = 1.7
    lean: float = 0.4
    offset_free: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive(rail=self.rail, lean=self.lean)
        if self.moves < 2:
            raise InputError(f"controller.moves is {self.moves}, expected 2 or more")
        if not self.horizon * self.rate >= self.moves:
            raise InputError(
                f"controller.horizon is {self.horizon:g} s, expected {self.moves / self.rate:.3g} s or more: one "
                "period for each move"
            )
        if self.offset_free is not None:
            check_positive(offset_free=self.offset_free)

    @property
    def moves_balance(self) -> bool:
        """Whether it plans about an estimated balance."""
        return self.offset_free is not None

    def on_rail(self, half: float) -> Self:
        """The controller that plans to stay within nearly all of a rail, -half to +half [m]."""
        return replace(self, rail=WITHIN * half)

    def plan(self, model: Model) -> Plan:
        """Predictions by a model's rigid body.

        Raises:
            InputError: the robot is no body on a carriage, or no gains stabilise it.
        """
        check_carriage(model)
        intervals = growing_intervals(1.0 / self.rate, self.horizon, self.moves)
        try:
            return Plan.of(linearise(model), *self.weights(model), intervals)
        except np.linalg.LinAlgError as error:
            raise InputError(f"controller: no stabilising gains for these weights ({error})") from error

    def law(self, model: Model) -> LinearLaw:
        """The feedback that it is while no limit acts.

        Raises:
            InputError: as in `plan`.
        """
        return LinearLaw.of(self.plan(model).gains)

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> "PredictiveRegulator":
        """Predictions by a model's rigid body, from a state estimated with the whole model.

        Raises:
            InputError: as in `plan`, or without limits it does not stabilise the whole model.
        """
        check_stabilises(self.law(model), model, self.rate)
        return PredictiveRegulator(self.estimator(model), self.plan(model), self)


class PredictiveRegulator(FilteredLoop):
    """Solves the programme where the plan without limits would violate one.

    Attributes:
        plan: Predictions.
        solve_times: Of every programme that was solved since the reset [s].
        unsolved: How many of them the solver did not finish; where it came to was done then.
    """

    def __init__(self, estimator: Ekf, plan: Plan, settings: Mpc) -> None:
        super().__init__(estimator, settings.rate, settings.limit)
        self.plan = plan
        self._by_state = np.vstack([plan.commands_by_state, plan.states_by_state[:, 0], plan.states_by_state[:, 1]])
        self._bounds = np.repeat([settings.limit, settings.rail, settings.lean], len(plan.weights))
        self._programme = Programme(plan, self._bounds)
        self._soft = SoftUpdate(ALPHA, BETA)
        self._watch = None if settings.offset_free is None else BalanceWatch(estimator.model, settings.offset_free)
        self._forget(0.0)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; see `Loop.reset`."""
        super().reset(t, measured)
        self._programme.reset()
        self._forget(t)

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit; see `FilteredLoop.wanted`."""
        about = reference + np.array([0.0, self._balance(t, state), 0.0, 0.0])
        error = state - about
        free = self._by_state @ error + np.repeat([0.0, about[0], about[1]], len(self.plan.weights))
        feedback = -self.plan.gains @ error
        if np.all(np.abs(free) <= self._bounds):
            return feedback
        began = perf_counter()
        move, solved = self._programme.first_move(free)
        self.solve_times.append(perf_counter() - began)
        self.unsolved += not solved
        return feedback + move

    def _balance(self, t: float, state: np.ndarray) -> float:
        """Pitch of balance about which the plan is made [rad]."""
        if self._watch is None:
            return 0.0
        self._watch.see(t, state)
        self._soft.advance(self._watch.pitch or 0.0, t - self._t)
        self._t = t
        return self._soft.smooth

    def _forget(self, t: float) -> None:
        self._t = t
        self._soft.reset()
        self.solve_times: list[float] = []
        self.unsolved = 0
        if self._watch is not None:
            self._watch.reset()


class Programme:
    """The quadratic programme of a plan: least squared moves that keep commands, position and pitch within bounds.

    Moves are scaled so that each costs its square; two further variables, scaled alike, are by how much position and
    pitch may violate their bounds.

    Args:
        plan: Predictions.
        bounds: Of commands, positions and pitches, +-, shape (3 N,).
    """

    def __init__(self, plan: Plan, bounds: np.ndarray) -> None:
        import osqp
        from scipy import sparse

        count = len(plan.weights)
        scale = 1.0 / np.sqrt(plan.weights)
        by_moves = np.vstack([plan.commands_by_moves, plan.states_by_moves[:, 0], plan.states_by_moves[:, 1]]) * scale
        commands, states = by_moves[:count], by_moves[count:]
        slack = np.repeat(np.diag(1.0 / np.sqrt(SOFTNESS)), count, axis=0)
        rows = np.block(
            [[commands, np.zeros((count, 2))], [states, -slack], [states, slack], [np.zeros((2, count)), np.eye(2)]]
        )
        self._count, self._bounds, self._scale = count, bounds, scale[0]
        self._low = np.full(len(rows), -np.inf)
        self._low[-2:] = 0.0
        self._high = np.full(len(rows), np.inf)
        self._solver = osqp.OSQP()
        self._solver.setup(
            P=sparse.csc_matrix(2.0 * np.eye(count + 2)),
            q=np.zeros(count + 2),
            A=sparse.csc_matrix(rows),
            l=self._low,
            u=self._high,
            eps_abs=TOLERANCE,
            eps_rel=TOLERANCE,
            max_iter=ITERATIONS,
            check_termination=10,
            warm_starting=True,
            verbose=False,
        )
        self._nothing = (np.zeros(count + 2), np.zeros(len(rows)))

    def reset(self) -> None:
        """Begin the next programme at zero; each begins where the one before it ended otherwise."""
        self._solver.warm_start(*self._nothing)

    def first_move(self, free: np.ndarray) -> tuple[float, bool]:
        """The first move [N], and whether the solver finished.

        Args:
            free: Commands, positions and pitches without moves, shape (3 N,).
        """
        n = self._count
        self._low[:n], self._high[:n] = -self._bounds[:n] - free[:n], self._bounds[:n] - free[:n]
        self._high[n : 3 * n] = self._bounds[n:] - free[n:]
        self._low[3 * n : 5 * n] = -self._bounds[n:] - free[n:]
        self._solver.update(l=self._low, u=self._high)
        found = self._solver.solve(raise_error=False)
        move = float(found.x[0]) if found.x is not None else float("nan")
        return (self._scale * move if isfinite(move) else 0.0), found.info.status == "solved"
