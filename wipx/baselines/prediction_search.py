"""Prediction errors of many candidates at little cost, and what a fit to them would lose without an effect.

The state at a window's start is not estimated anew for every candidate: the nominal model's estimate is corrected
once, along its own slopes. That makes a candidate two rollouts, about fifty times fewer than a full estimate.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from wipx.baselines.case import Problem
from wipx.core.model import Model, ModelBatch
from wipx.core.results import HORIZON
from wipx.effects.catalogue import effect_of
from wipx.identify.parameter_space import ParameterSpace, parameter_space
from wipx.identify.prediction import Prediction, Predictor
from wipx.identify.problem import WindowProblem
from wipx.identify.windows import Windows, cut
from wipx.sim.inputs import Inputs

LEAD = 0.1  # [s] before a prediction, from which its state is estimated; one correction does for so short a time
WINDOWS = 48  # that are predicted; of more, an even choice
STEP = 2.5e-3  # [s] of the integrator; twice as quick as the usual one, and exact enough for a search
LOSS_WITHOUT = 0.1  # share by which the squared error must grow without an effect for it to be named


@dataclass(frozen=True)
class CorrectedPredictor(Predictor):
    """Predicts from the nominal model's states, corrected once for each candidate.

    Attributes:
        initial: The nominal model's states, shape (2 joints, R).
        gain: Correction per error of the known rows, of the rows from the first known one on,
            shape (2 joints, rows, joints, R) [1, 1/s].
        seen: The windows up to the last known row.
    """

    initial: np.ndarray
    gain: np.ndarray
    seen: Inputs

    @classmethod
    def of(cls, predictor: Predictor, nominal: Model) -> "CorrectedPredictor":
        """For the windows of a predictor."""
        batch = ModelBatch(nominal)
        state = predictor.predict(batch).initial
        _, slopes = predictor.state_gain(batch, state)
        inverse = np.linalg.inv(slopes.normal[0])
        gain = -np.einsum("rab,rbkj->akjr", inverse, slopes.slopes[0], optimize=True)
        gain = gain / predictor.noise[:, None]
        windows = predictor.windows
        last = len(windows.known) - 1 - np.argmax(windows.known[::-1], axis=0)
        seen = windows.inputs.until(last)
        return cls(predictor.simulator, windows, predictor.noise, state[:, 0], gain, seen)

    def predict(self, batch: ModelBatch, near: np.ndarray | None = None, *, floor: bool = False) -> Prediction:
        """Correct the states, then predict; `near` and `floor` have no meaning here."""
        state = np.repeat(self.initial[:, None, :], batch.size, axis=1)
        shown = self.simulator.replay(batch, self.seen, state).coordinates
        residuals = self.residuals(shown, self.windows.known)[self.known_from :] * self.noise[:, None, None]
        state = state + np.einsum("akjr,kjpr->apr", self.gain, residuals, optimize=True)
        return Prediction(state, self.simulator.replay(batch, self.windows.inputs, state).coordinates, None)


@dataclass(frozen=True)
class PredictionSearch:
    """Fits effects of a case to its prediction errors.

    Attributes:
        case: The case.
        predictor: Predicts its windows.
    """

    case: Problem
    predictor: CorrectedPredictor

    @classmethod
    def of(cls, case: Problem) -> "PredictionSearch":
        """For an even choice of the case's windows.

        Raises:
            InputError: a recording is shorter than a window.
        """
        windows = cut(case.recordings, case.nominal.plant, horizon=HORIZON, lead=LEAD)
        chosen = np.unique(np.linspace(0, windows.count - 1, min(windows.count, WINDOWS)).astype(int))
        simulator = replace(case.simulator, step=STEP)
        predictor = Predictor(simulator, _chosen(windows, chosen), case.noise)
        return cls(case, CorrectedPredictor.of(predictor, case.nominal))

    def problem(self, effects: tuple[str, ...], nominal: Model | None = None) -> WindowProblem:
        """The loss over all parameters of some effects and the uncertain nominal ones.

        Args:
            effects: What may be added.
            nominal: To what; None for the owner's model.
        """
        nominal = nominal or self.case.nominal
        model = nominal.with_effects({name: effect_of(name, nominal.plant).neutral for name in effects})
        known = {name for name in self.case.uncertainty if name.rpartition(".")[0] in {"", *model.effects}}
        uncertainty = {name: self.case.uncertainty[name] for name in known}
        space = parameter_space(model, effects, uncertainty, {}, {}, self.case.scales)
        plain = WindowProblem(space, self.predictor, self.case.speeds)
        # Signals weighed by the nominal model's errors: a fine encoder would else drown the angle.
        return plain.reweighted(space.neutral).tempered(space.neutral)


def _chosen(windows: Windows, index: np.ndarray) -> Windows:
    """Some of the windows."""
    inputs = windows.inputs
    ramps = None if inputs.ramps is None else inputs.ramps[:, :, index]
    return Windows(
        replace(
            inputs,
            t=inputs.t[:, index],
            commands=inputs.commands[:, :, index],
            first=inputs.first[index],
            last=inputs.last[index],
            ramps=ramps,
        ),
        windows.recorded[:, :, index],
        windows.known[:, index],
        windows.predicted[:, index],
        windows.recording[index],
        windows.row[index],
        windows.starts[index],
    )


def at(space: ParameterSpace, cube: np.ndarray) -> Model:
    """The model at a position (D,) of the unit cube."""
    return space.model.with_values(dict(zip(space.names, space.to_values(cube).tolist(), strict=True)))


def needed(problem: WindowProblem, cube: np.ndarray, effects: Iterable[str]) -> dict[str, float]:
    """Effects that the predictions need, and the share by which the loss grows without each.

    The one that matters least is set back to neutral, the others kept as they are, as long as the loss stays within
    `LOSS_WITHOUT` of what it was with all of them.

    Args:
        problem: The loss.
        cube: Where the search ended, shape (D,).
        effects: Those that were searched.
    """
    names, neutral = problem.space.names, problem.space.neutral
    own = {effect: np.array([name.rpartition(".")[0] == effect for name in names]) for effect in effects}
    allowed = (1.0 + LOSS_WITHOUT) * float(problem.losses(cube)[0])
    left = dict(own)
    while left:
        losses = problem.losses(np.stack([cube, *(np.where(of, neutral, cube) for of in left.values())]))
        least = int(np.argmin(losses[1:]))
        if losses[1 + least] > allowed:
            return {effect: float(loss / losses[0] - 1.0) for effect, loss in zip(left, losses[1:], strict=True)}
        cube = np.where(left.pop(list(left)[least]), neutral, cube)
    return {}
