"""Prediction errors of short windows as MuJoCo's system identification toolbox (`mujoco.sysid`) computes them.

The toolbox compiles the MJCF of every candidate, rolls it out on each window, and collects the residuals; what it
leaves to its user comes through its hooks: how a candidate becomes a model (`build_model`), how a late drive sees the
commands (`custom_rollout`), and how sensors show the motion (`modify_residual`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from wipx.baselines.prediction_search import at
from wipx.core.model import Model, ModelBatch
from wipx.effects.catalogue import kind_of
from wipx.identify.prediction import DIVERGED, Predictor
from wipx.identify.problem import WindowProblem
from wipx.identify.windows import Windows
from wipx.sim.mjcf import BUILT_IN, mjcf

STEP = 2.5e-3  # [s] of the integrator
DIFFERENCE = 1e-3  # of the search interval, for slopes; sticking joints answer to less in jumps
PULL = 10.0  # towards the neutral values, over the whole search interval, in typical residuals of one row
SEEN = 1e-3  # of the strongest; directions of the state that a window tells less of are not free in it
IN_THE_BODY = ("inertia",)  # effects that change masses
ON_SIGNALS = ("delay", "scale", "bias")  # effects that the hooks apply


def is_expressible(effect: str) -> bool:
    """Whether the toolbox can have an effect "site/kind"."""
    return kind_of(effect).built_in in BUILT_IN or effect.partition("/")[2] in (*IN_THE_BODY, *ON_SIGNALS)


@dataclass(frozen=True)
class Toolbox:
    """MuJoCo's modules.

    Attributes:
        mujoco: The engine.
        sysid: System identification.
        minimize: Nonlinear least squares.
    """

    mujoco: Any
    sysid: Any
    minimize: Any


@dataclass(frozen=True)
class Piece:
    """One window, ready for the toolbox; times count from its first row.

    Attributes:
        edges: Times of the rows whose commands are known, from long before the first one on, shape (rows,) [s].
        impulse: Integral of the commands up to each of them, shape (rows, inputs) [N s or N m s].
        ramps: Change of the commands along the row before each of `edges[1:]`, shape (rows - 1, inputs).
        times: Times of the rows that are predicted, shape (n,) [s].
        recorded: What they should be, shape (n, joints) [m or rad].
        weight: Of its residuals.
    """

    edges: np.ndarray
    impulse: np.ndarray
    ramps: np.ndarray
    times: np.ndarray
    recorded: np.ndarray
    weight: float

    @property
    def steps(self) -> int:
        """Steps of the integrator that reach the last row."""
        return int(np.ceil(self.times[-1] / STEP - 1e-9))

    def commands(self, delay: float) -> np.ndarray:
        """Mean of the late command over each step, shape (steps + 1, inputs); the last row is never used."""
        edges = STEP * np.arange(self.steps + 2) - delay
        row = np.clip(np.searchsorted(self.edges, edges, side="right") - 1, 0, len(self.edges) - 2)
        lengths = np.diff(self.edges)[row][:, None]
        along = (edges - self.edges[row])[:, None] / lengths
        held = np.diff(self.impulse, axis=0)[row] * along
        bent = 0.5 * self.ramps[row] * lengths * (along**2 - along)
        return np.diff(self.impulse[row] + held + bent, axis=0) / STEP


@dataclass(frozen=True)
class Start:
    """The state at a window's first row, and what small changes of it do to the residuals.

    Attributes:
        state: Coordinates, then rates, shape (2 joints,).
        slopes: Shape (n joints, 2 joints), per step of the state.
    """

    state: np.ndarray
    slopes: np.ndarray

    @cached_property
    def explained(self) -> np.ndarray:
        """Orthonormal residuals that another state explains, shape (n joints, up to 2 joints)."""
        directions, sizes, _ = np.linalg.svd(self.slopes, full_matrices=False)
        return directions[:, sizes > SEEN * max(float(sizes[0]), 1e-300)]


@dataclass(frozen=True, kw_only=True)
class ToolboxProblem(WindowProblem):
    """The windows' prediction errors, simulated by MuJoCo; every window's own state is free.

    Attributes:
        toolbox: MuJoCo's modules.
        smoother: Estimates a model's state at every window's first row, as predictions do.
        chosen: Windows that are predicted.
        pieces: These windows.
        starts: Their states.
        level: Typical residual of a row; a prior's standard deviation weighs as much.
    """

    toolbox: Toolbox
    smoother: Predictor
    chosen: tuple[int, ...]
    pieces: tuple[Piece, ...]
    starts: tuple[Start, ...]
    level: float = 1.0

    @classmethod
    def of(cls, problem: WindowProblem, noise: np.ndarray, chosen: np.ndarray, toolbox: Toolbox) -> "ToolboxProblem":
        """The same search, simulated by MuJoCo, about the nominal model.

        Args:
            problem: The search, its windows and weights.
            noise: Of the sensors, shape (joints,) [m or rad].
            chosen: Windows that are predicted.
            toolbox: MuJoCo's modules.
        """
        windows = problem.predictor.windows
        weights = np.ones(windows.count) if problem.weights is None else problem.weights
        bare = cls(
            problem.space,
            problem.predictor,
            problem.speeds,
            problem.weights,
            toolbox=toolbox,
            smoother=Predictor(problem.predictor.simulator, windows, noise),
            chosen=tuple(chosen.tolist()),
            pieces=tuple(_piece(windows, r, float(weights[r])) for r in chosen),
            starts=(),
        )
        return bare.about(problem.space.neutral)

    def about(self, cube: np.ndarray) -> "ToolboxProblem":
        """The same problem about the states that the model at a position (D,) has."""
        model = at(self.space, cube)
        states = self.smoother.predict(ModelBatch(model)).initial[:, 0, self.chosen]
        starts = tuple(self._start(model, piece, state) for piece, state in zip(self.pieces, states.T, strict=True))
        moved = replace(self, starts=starts, level=0.0, _last=[])
        return replace(moved, level=float(np.sqrt(moved.losses(cube)[0])), _last=[])

    def losses(self, cube: np.ndarray) -> np.ndarray:
        """Mean squared residual and priors of every candidate, shape (P,)."""
        return np.sum(self.columns(np.atleast_2d(cube).T) ** 2, axis=0) / sum(p.recorded.size for p in self.pieces)

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        """Residuals of the windows, then of the priors, at a position (D,), shape (N,)."""
        return self.columns(cube[:, None])[:, 0]

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        """Their slopes by the toolbox's differences of at least `DIFFERENCE`, shape (N, D)."""
        step = max(float(np.max(size)), DIFFERENCE)
        bounds = [np.zeros((len(cube), 1)), np.ones((len(cube), 1))]
        at_cube = self.residuals(cube)[:, None]
        return self.toolbox.minimize.jacobian_fd(self.columns, cube[:, None], at_cube, step, 0, bounds)[0]

    def columns(self, cubes: np.ndarray) -> np.ndarray:
        """Residuals (N, P) at positions (D, P)."""
        return np.concatenate(self.toolbox_residuals(cubes, self.parameters(self.space.neutral))[0])

    def parameters(self, cube: np.ndarray) -> Any:
        """The toolbox's parameters: one vector in the unit cube, since its differences take steps of one size."""
        parameters = self.toolbox.sysid.ParameterDict()
        parameters.add(self.toolbox.sysid.Parameter("cube", cube, np.zeros(len(cube)), np.ones(len(cube))))
        return parameters

    def toolbox_residuals(self, x: np.ndarray, parameters: Any) -> tuple[list[np.ndarray], None, None]:
        """What the toolbox asks of a residual: arrays (n, P) for positions (D, P), a window each, the priors last.

        A weak pull towards the neutral values settles what no recording tells (a gain and a scale on a bare axis).
        """
        columns = x.reshape(len(x), -1)
        every = [residual(columns, parameters)[0][0] for residual in self._residuals]
        pull = PULL * (columns - self.space.neutral[:, None])
        return [*every, self.level * self.space.prior_residuals(columns.T).T, self.level * pull], None, None

    @cached_property
    def _residuals(self) -> list[Callable[..., Any]]:
        """The toolbox's residual of each window."""
        compiled = lru_cache(maxsize=64)(lambda values: self._compiled(at(self.space, np.array(values))))
        nominal = at(self.space, self.space.neutral)
        spec = self.toolbox.mujoco.MjSpec.from_string(mjcf(nominal, STEP, built_in=BUILT_IN))
        return [
            self.toolbox.sysid.build_residual_fn(
                models_sequences=[self._sequence(nominal, spec, piece, start)],
                build_model=lambda parameters, _: compiled(tuple(parameters["cube"].value.tolist())),
                custom_rollout=_Rollout(self, piece),
                modify_residual=_Residual(self, piece, start),
                n_threads=1,
                resample_true=False,
            )
            for piece, start in zip(self.pieces, self.starts, strict=True)
        ]

    def _compiled(self, model: Model) -> Any:
        return self.toolbox.mujoco.MjModel.from_xml_string(mjcf(model, STEP, built_in=BUILT_IN))

    def _sequence(self, nominal: Model, spec: Any, piece: Piece, start: Start) -> Any:
        commands = piece.commands(0.0)
        control = self.toolbox.sysid.TimeSeries(STEP * np.arange(len(commands)), commands)
        measured = self.toolbox.sysid.TimeSeries.from_names(piece.times, piece.recorded, self._compiled(nominal))
        return self.toolbox.sysid.ModelSequences(
            "plant", spec, "window", self._full_state(nominal, start.state), control, measured
        )

    def _full_state(self, model: Model, state: np.ndarray) -> np.ndarray:
        joints = len(state) // 2
        return self.toolbox.sysid.create_initial_state(self._compiled(model), state[:joints], state[joints:])

    def _start(self, model: Model, piece: Piece, state: np.ndarray) -> Start:
        """A state, and what a change by about the sensor noise does, by differences of rollouts."""
        noise = self.smoother.noise
        states = np.vstack([state, state + np.diag(np.concatenate([noise, 10.0 * noise]))])
        every = np.stack([self.scaled(piece, self._replayed(model, piece, moved)) for moved in states])
        return Start(state, (every[1:] - every[0]).T)

    def _replayed(self, model: Model, piece: Piece, state: np.ndarray) -> np.ndarray:
        """Coordinates that the sensors show at a window's rows, shape (n, joints)."""
        compiled = self._compiled(model)
        control = self.toolbox.sysid.TimeSeries(STEP * np.arange(piece.steps + 1), piece.commands(drive_delay(model)))
        (rollout,) = self.toolbox.sysid.sysid_rollout(
            [compiled], [self.toolbox.mujoco.MjData(compiled)], [control], [self._full_state(model, state)]
        )
        return shown(model, piece, state, rollout.state.data)

    def scaled(self, piece: Piece, coordinates: np.ndarray) -> np.ndarray:
        """Recorded minus shown in standard deviations, weighed, shape (..., n joints)."""
        largest = DIVERGED * self._ranges
        errors = np.clip(np.nan_to_num(piece.recorded - coordinates, nan=np.inf), -largest, largest)
        weighed = piece.weight * errors / self.predictor.noise
        return weighed.reshape(*weighed.shape[:-2], -1)

    @cached_property
    def _ranges(self) -> np.ndarray:
        return np.ptp(np.concatenate([piece.recorded for piece in self.pieces]), axis=0) + self.predictor.noise


@dataclass(frozen=True)
class _Rollout:
    """The toolbox's rollout with each candidate's late commands."""

    problem: ToolboxProblem
    piece: Piece

    def __call__(
        self,
        *,
        models: Sequence[Any],
        datas: Sequence[Any],
        control_signal: Sequence[Any],
        initial_states: Sequence[np.ndarray],
        param_dicts: Sequence[Any],
        rollout_signal_mapping: Mapping[str, Any],
        rollout_state_mapping: Mapping[str, Any],
        ctrl_mapping: Mapping[str, Any],
    ) -> Sequence[Any]:
        """Trajectories of the candidates, one each."""
        candidates = [at(self.problem.space, parameters["cube"].value) for parameters in param_dicts]
        controls = [
            replace(control, data=self.piece.commands(drive_delay(candidate)))
            for control, candidate in zip(control_signal, candidates, strict=True)
        ]
        return self.problem.toolbox.sysid.sysid_rollout(
            models, datas, controls, initial_states, rollout_signal_mapping, rollout_state_mapping, ctrl_mapping
        )


@dataclass(frozen=True)
class _Residual:
    """Recorded minus shown, less what another state at the window's start explains."""

    problem: ToolboxProblem
    piece: Piece
    start: Start

    def __call__(
        self,
        parameters: Any,
        predicted: Any,
        measured: Any,
        model: Any,
        return_pred_all: bool,
        *,
        state: np.ndarray,
        sensor_weights: Mapping[str, float] | None = None,
    ) -> tuple[np.ndarray, Any, Any]:
        """Residuals (n joints,) of one candidate, and the two series as they came."""
        candidate = at(self.problem.space, parameters["cube"].value)
        residuals = self.problem.scaled(self.piece, shown(candidate, self.piece, self.start.state, state))
        explained = self.start.explained
        return residuals - explained @ (explained.T @ residuals), predicted, measured


def drive_delay(model: Model) -> float:
    """Delay of the drive [s]."""
    return model.effects["actuator/delay"]["tau"] if "actuator/delay" in model.effects else 0.0


def shown(model: Model, piece: Piece, initial: np.ndarray, states: np.ndarray) -> np.ndarray:
    """What the sensors show of a rollout at a window's rows, shape (n, joints) [m or rad].

    Args:
        model: Its sensors' delays, scales and biases.
        piece: The window.
        initial: State at its first row, shape (2 joints,).
        states: Rows (time, coordinates, rates) after each step.
    """
    columns = []
    times = np.concatenate([[0.0], states[:, 0]]) + 0.5 * STEP  # semi-implicit Euler is half a step ahead
    for j, column in enumerate(model.plant.coordinates):
        late, scale, bias = (
            model.effects.get(f"sensor_{column}/{kind}", {symbol: 0.0})[symbol]
            for kind, symbol in (("delay", "tau"), ("scale", "e"), ("bias", "b"))
        )
        true = np.interp(piece.times - late, times, np.concatenate([[initial[j]], states[:, 1 + j]]))
        columns.append((1.0 + scale) * true + bias)
    return np.column_stack(columns)


def _piece(windows: Windows, r: int, weight: float) -> Piece:
    """A window without its padding."""
    inputs = windows.inputs
    last = int(inputs.last[r])
    edges = inputs.t[: last + 1, r] - inputs.t[inputs.first[r], r]
    commands = inputs.commands[:last, :, r]
    ramps = np.zeros_like(commands) if inputs.ramps is None else inputs.ramps[:last, :, r]
    impulse = np.concatenate([np.zeros((1, commands.shape[1])), np.cumsum(commands * np.diff(edges)[:, None], axis=0)])
    rows = np.flatnonzero(windows.predicted[:, r])
    return Piece(edges, impulse, ramps, edges[rows], windows.recorded[rows, :, r], weight)
