"""Recordings of robots whose missing physics is known, logged well or badly, and what a diagnosis makes of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import yaml
from identify.emulated_robot import BODIES, RATE, Effects, Robot, controller, nominal_model

from wipx.core.diagnosis import Diagnosis
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator

SIMULATOR = AnalyticSimulator(threads=1)
Recordings = tuple[Recording, ...]


@dataclass(frozen=True)
class Bench:
    """Recordings beside the nominal model, with what fits hypotheses to them.

    Attributes:
        nominal: What the owner believes.
        recordings: Of the robot.
        uncertainty: Relative standard deviation of nominal numbers.
    """

    nominal: Model
    recordings: Recordings
    uncertainty: Mapping[str, float]

    @cached_property
    def setting(self) -> Setting:
        return Setting(self.nominal, self.uncertainty, scales_of(self.nominal, self.recordings))

    @cached_property
    def data(self) -> RecordingBatch:
        return RecordingBatch.of(self.recordings, self.nominal.plant)

    @cached_property
    def fitter(self) -> InnovationFitter:
        return InnovationFitter(InnovationsModel.of(SIMULATOR, self.data, self.nominal))

    @cached_property
    def quiet(self) -> NoiseLevels:
        """The sensors' noise and hardly any noise of the forces."""
        force = np.array([1e-4 * self.setting.scales[site].force for site in self.nominal.plant.joints])
        return NoiseLevels(force, sensor_noise(self.recordings, self.nominal.plant))

    def fit(self, *effects: str) -> Fit:
        """These effects fitted from their usual values on."""
        return self.fitter.converged(self.fitter.fit(Hypothesis.of(self.setting, effects, {}), self.quiet))

    def diagnosed(self, suspects: Mapping[str, Mapping[str, float]] | None = None) -> Diagnosis:
        """The answer, asked about suspects."""
        return diagnose(self.recordings, KnownRobot(self.nominal, self.uncertainty), SIMULATOR, suspects=suspects)


def recorded(kind: str, effects: Effects, seed: int, *, count: int = 2, duration: float = 3.0) -> Recordings:
    """Recordings of a nominal robot with some effects that its owner does not know."""
    robot = Robot(nominal_model(kind).with_effects(effects), duration)
    return robot.record(np.random.default_rng(seed), count)


def bench(kind: str, effects: Effects, seed: int, *, count: int = 2, duration: float = 3.0) -> Bench:
    """A bench with such recordings."""
    return Bench(nominal_model(kind), recorded(kind, effects, seed, count=count, duration=duration), {})


def forecasts(case: Bench) -> ForecastFitter:
    """What fits hypotheses to predictions of half a second of the bench's recordings."""
    doubted = case.setting.doubted(case.fitter.rules.forecasts.undeclared)
    return ForecastFitter(case.fitter, case.quiet, case.quiet, doubted)


def shaken(case: Bench, rng: np.random.Generator) -> Bench:
    """The same runs under a force that wanders, as of a cable: what is recorded of the command lacks it."""
    recordings = []
    for r in case.recordings:
        wander = np.zeros(len(r))
        for k in range(1, len(r)):
            wander[k] = 0.98 * wander[k - 1] + 0.2 * 0.15 * np.std(r["u"]) * rng.normal()
        recordings.append(_changed(r, {"u": r["u"] + wander}))
    return replace(case, recordings=tuple(recordings))


def coloured(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """With sensor noise of a memory of some ten rows beside the white one."""
    return tuple(
        _changed(r, {name: r[name] + _slow_noise(r, name, rng) for name in _coordinates(r)}) for r in recordings
    )


def coarse(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """With encoders of half a millimetre and a milliradian."""
    steps = {"x": 5e-4, "theta": 1e-3, "theta1": 1e-3, "theta2": 1e-3}
    return tuple(
        _changed(r, {name: np.round(r[name] / steps[name]) * steps[name] for name in _coordinates(r)})
        for r in recordings
    )


def dropped(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """With every twentieth row lost, by chance."""
    return tuple(thinned(r, np.flatnonzero(rng.random(len(r)) > 0.05)) for r in recordings)


def jittered(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """Logged at every second row on average, sometimes at the next or the one before."""
    kept = [np.cumsum(rng.choice((1, 2, 2, 3), len(r) // 2)) for r in recordings]
    return tuple(thinned(r, k[k < len(r)]) for r, k in zip(recordings, kept, strict=True))


def slow(recordings: Recordings, rng: np.random.Generator) -> Recordings:
    """Logged at every third row, with the mean command."""
    return tuple(thinned(r, np.arange(0, len(r), 3)) for r in recordings)


def thinned(recording: Recording, kept: np.ndarray) -> Recording:
    """Some rows of a recording; the command of each is the mean of those that acted until the next."""
    dt = np.diff(recording.t, append=2.0 * recording.t[-1] - recording.t[-2])
    columns = {name: values[kept] for name, values in recording.columns.items()}
    for name in ("u", "u1", "u2"):
        if name in recording:
            columns[name] = np.add.reduceat(recording[name] * dt, kept) / np.add.reduceat(dt, kept)
    return Recording(recording.name, columns, recording.source, max(1, round(float(np.median(np.diff(kept))))))


def _changed(recording: Recording, columns: Mapping[str, np.ndarray]) -> Recording:
    return Recording(recording.name, {**recording.columns, **columns}, recording.source, recording.periods)


def _coordinates(recording: Recording) -> list[str]:
    return [name for name in ("x", "theta", "theta1", "theta2") if name in recording]


def _slow_noise(recording: Recording, name: str, rng: np.random.Generator) -> np.ndarray:
    size = 1e-4 if name == "x" else 4e-4
    noise = np.zeros(len(recording))
    for k, kick in enumerate(rng.normal(size=len(recording)) * size * np.sqrt(1.0 - 0.9**2)):
        noise[k] = 0.9 * noise[k - 1] + kick
    return noise


def write_folder(folder: Path, kind: str, recordings: Recordings, columns: tuple[str, ...]) -> Path:
    """A folder as contract section 1 has it."""
    folder.mkdir()
    gains = controller(kind).gains.ravel().tolist()
    described = {
        "plant": kind,
        "parameters": BODIES[kind],
        "controller": {"kind": "lqr", "gains": gains, "rate": RATE},
    }
    (folder / "robot.yaml").write_text(yaml.safe_dump(described))
    for recording in recordings:
        header = ",".join(columns)
        np.savetxt(
            folder / recording.name, recording.stack(columns), fmt="%.10g", delimiter=",", header=header, comments=""
        )
    return folder
