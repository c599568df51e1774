"""`task=predict`: predictions of recordings by a model, exactly as contract section 4 has them."""

from dataclasses import dataclass, replace
from pathlib import Path, PurePath

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import HORIZON, FitErrors, Trace
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.identify.resolution import resolving
from wipx.recordings.model_file import read_model
from wipx.recordings.source import RecordingSource
from wipx.sim.simulator import Simulator
from wipx.tasks.files.results import write_csv, write_json, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class Predict:
    """Predict every recording, restarted every 0.5 s.

    Attributes:
        residual: A residual.npz whose learned acceleration is added to the model's; None for none.
    """

    residual: str | None = None

    def run(self, job: Job) -> None:
        """Write metrics.json and one csv of predicted columns for each recording."""
        source: RecordingSource = job.part("recordings")
        nominal: Model = job.part("plant").nominal(source.describe().model)
        model = read_model(job.model_path) if job.model_path else nominal
        if model.plant != nominal.plant:
            raise InputError(
                f"{job.model_path}: a model of plant {model.plant.kind}, "
                f"expected {nominal.plant.kind} as in {source.name}"
            )
        recordings, simulator = source.load(), job.part("sim")
        errors, traces = self.compared(nominal, model, recordings, simulator)
        columns = model.plant.coordinates
        with written_together(job.out) as folder:
            for trace in traces:
                table = {"t": trace.t, **{name: trace.completed[name] for name in columns}}
                write_csv(folder / _file_name(trace.name, joined=isinstance(source.path, list)), table)
            write_json(
                folder / "metrics.json",
                {
                    "schema": 1,
                    "model": str(job.model_path) if job.model_path else "nominal",
                    "residual": self.residual,
                    "horizon_s": HORIZON,
                    "windows": errors.windows,
                    "rms": errors.completed,
                    "rms_nominal": errors.nominal,
                    "noise_floor": errors.noise_floor,
                    "recordings": {t.name: {n: _rms(t.completed[n] - t.recorded[n]) for n in columns} for t in traces},
                },
            )
        figures = ", ".join(f"{n} {errors.completed[n]:.4g} {model.plant.unit_of(n)}" for n in columns)
        print(f"rms error of {errors.windows} predictions over {HORIZON:g} s: {figures}; written to {job.out}")

    def compared(
        self, nominal: Model, model: Model, recordings: tuple[Recording, ...], simulator: Simulator
    ) -> tuple[FitErrors, tuple[Trace, ...]]:
        """Errors of two models on the same windows, the second with the learned acceleration, and what they predicted.

        Raises:
            InputError: the recordings are too short, or the learned acceleration is none of this robot.
        """
        noise = sensor_noise(recordings, model.plant)
        judge = Judge(resolving(simulator, model, recordings, noise), noise, HORIZON)
        errors, traces = judge.compare(nominal, model, recordings, held_out=True)
        if self.residual is None:
            return errors, traces
        learned = replace(judge, simulator=self._learned(model, judge.noise))
        beside, traces = learned.compare(model, model, recordings, held_out=True)
        return replace(errors, completed=beside.completed, noise_floor=beside.noise_floor), traces

    def _learned(self, model: Model, noise: np.ndarray) -> Simulator:
        """The simulator with the learned acceleration."""
        from wipx.baselines.learned_simulator import learned_simulator
        from wipx.baselines.network import read_network

        assert self.residual is not None
        joints = len(model.plant.joints)
        inputs = 2 * joints + len(model.plant.commands)
        network = read_network(Path(self.residual), features=inputs, joints=joints)
        return learned_simulator(network, noise)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else float("nan")


def _file_name(recording: str, *, joined: bool) -> str:
    """The file that takes the predictions of a recording; one of several joined folders keeps its folder's name."""
    path = PurePath(recording).with_suffix(".csv")
    return "_".join(path.parts) if joined else path.name
