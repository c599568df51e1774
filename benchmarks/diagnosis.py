"""Time of a diagnosis, and of the rounds of the search over noise levels that most of it once was.

Six recordings of 5 s at 650 Hz of a wheeled inverted pendulum that lacks Coulomb friction, with a gyro.
"""

import numpy as np
from kernel import BODY, RATE
from timing import interleaved, print_table, processor_time

from wipx.control.lqr import Lqr
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.noise_model import noise_model_of
from wipx.diagnosis.likelihood.observer import NoiseLevels, observer_gains
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

RECORDINGS, DURATION = 6, 5.0
MISSING = {"translation/coulomb": {"F_c": 0.5}}
NOISE = {"x": 5e-4, "theta": 1e-3, "x_dot": 0.02, "theta_dot": 0.01}  # [m, rad, m/s, rad/s]
LEVELS = 11  # a round: up and down for five levels, and all moves that gain at once
ROUNDS = 5


def measure_diagnosis() -> dict[str, float]:
    """Processor times in s, one thread."""
    plant = plant_of("wip")
    nominal = Model(plant, plant.complete(BODY, "benchmark"), {})
    recordings = _record(nominal.with_effects(MISSING), nominal, np.random.default_rng(1))
    simulator = AnalyticSimulator(threads=1)
    data = RecordingBatch.of(recordings, plant)
    fitter = InnovationFitter(InnovationsModel.of(simulator, data, nominal))
    hypothesis = Hypothesis.of(Setting(nominal, {}, scales_of(nominal, recordings)), (), {})
    forces = 0.01 * np.exp(np.linspace(-2.0, 2.0, LEVELS))
    levels = [NoiseLevels(np.full(2, force), np.array(list(NOISE.values()))) for force in forces]
    body = fitter.innovations_model.linear, fitter.innovations_model.jolts
    gains = observer_gains(*body, data, levels)
    batch = hypothesis.space.batch(np.repeat(hypothesis.cube[None], LEVELS, axis=0))
    follow = (batch, gains, np.arange(LEVELS))
    innovations = fitter.innovations_model.innovations(*follow)
    parts = interleaved(
        {
            "gains": lambda: observer_gains(*body, data, levels),
            "simulation, innovations": lambda: fitter.innovations_model.innovations(*follow),
            "noise models": lambda: [noise_model_of(each, data) for each in innovations],
        },
        ROUNDS,
    )
    found = {name: timing.median for name, timing in parts.items()}
    found["the whole diagnosis"] = processor_time(lambda: diagnose(recordings, KnownRobot(nominal, {}), simulator))
    print_table(
        f"Diagnosis of {RECORDINGS} recordings of {DURATION:g} s, one thread; its parts for {LEVELS} noise levels",
        ("part", "processor s"),
        [(name, f"{seconds:.3f}") for name, seconds in found.items()],
    )
    return found


def _record(truth: Model, nominal: Model, rng: np.random.Generator) -> tuple[Recording, ...]:
    """Positions that follow sines under a regulator."""
    inputs = Inputs.regular(DURATION, RATE, 1, RECORDINGS)
    rows = len(inputs.t) - 1
    references = np.zeros((rows, 4, RECORDINGS))
    references[:, 0] = 0.2 * np.sin(np.outer(inputs.t[:-1, 0], np.linspace(1.0, 4.0, RECORDINGS)))
    run = AnalyticSimulator(threads=1).close_loop(
        ModelBatch(truth), inputs, np.zeros((4, 1, RECORDINGS)), Lqr().feedback(nominal), references
    )
    shown = np.concatenate([run.coordinates, run.rates], axis=1)[:-1, :, 0]
    shown += np.array(list(NOISE.values()))[:, None] * rng.normal(size=shown.shape)
    columns = [dict(zip(NOISE, shown[:, :, r].T, strict=True)) for r in range(RECORDINGS)]
    return tuple(
        Recording(f"r{r}.csv", {"t": inputs.t[:-1, r], "u": run.commands[:, 0, 0, r], **columns[r]})
        for r in range(RECORDINGS)
    )


if __name__ == "__main__":
    measure_diagnosis()
