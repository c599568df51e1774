"""`task=baseline`: what people would use in place of a diagnosis, on the same recordings, judged by the same score."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.baselines.case import Answer, Baseline, Found, Problem
from wipx.baselines.learned_simulator import learned_simulator
from wipx.core.effect import Effect
from wipx.core.errors import InputError
from wipx.core.plant import Plant
from wipx.core.results import HORIZON, FitErrors
from wipx.effects.catalogue import effect_of, kind_of
from wipx.identify.evaluation import Judge
from wipx.identify.windows import check_long_enough
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.files.results import write_json, written_together
from wipx.tasks.files.tracked import error_metrics, log_run, note_run, parameter_metrics, recorded_data
from wipx.tasks.shared.job import Job
from wipx.tracking.run_note import DataNote

NETWORK = "residual.npz"


@dataclass(frozen=True)
class RunBaseline:
    """Ask a baseline about the recordings of a source."""

    def run(self, job: Job) -> None:
        """Write diagnosis.json, model.yaml and, of a baseline that learned one, the network."""
        source: RecordingSource = job.part("recordings")
        description = source.describe()
        baseline: Baseline = job.part("baseline")
        if description.model.plant.tree is not None and not baseline.of_trees:
            name = job.chosen.get("baseline", type(baseline).__name__)
            raise InputError(
                f"{source.place}: baseline={name} cannot do a robot from a model file yet; use baseline=all_at_once"
            )
        nominal = job.part("plant").nominal(description.model)
        recordings = source.load()
        check_long_enough(recordings)
        case = Problem(recordings, nominal, description.uncertainty, job.part("sim"))
        begun = time.perf_counter()
        answer = baseline.answer(case, np.random.default_rng(job.seed))
        seconds = time.perf_counter() - begun
        errors = _errors(case, answer)
        content = diagnosis(answer, errors, case) | {"source": source.place, "seconds": seconds}
        (job.out / NETWORK).unlink(missing_ok=True)  # of an earlier run
        with written_together(job.out) as folder:
            write_json(folder / "diagnosis.json", content)
            write_model(answer.model, folder / "model.yaml")
            if answer.network is not None:
                answer.network.write(folder / NETWORK)
            _note(job, folder, recorded_data(source, recordings, "diagnosis"), answer, errors, seconds)
        log_run(job)
        named = ", ".join(found.name for found in answer.found) or "nothing by name"
        print(f"{content['verdict']}: {named}; {seconds:.1f} s; written to {job.out}")


def _errors(case: Problem, answer: Answer) -> FitErrors:
    """Prediction errors on the recordings that were fitted."""
    judge = Judge(case.simulator, case.noise, HORIZON)
    errors, _ = judge.compare(case.nominal, answer.model, case.recordings, held_out=False)
    if answer.network is None:
        return errors
    learned = Judge(learned_simulator(answer.network, case.noise), case.noise, HORIZON)
    black_box, _ = learned.compare(answer.model, answer.model, case.recordings, held_out=False)
    return FitErrors(errors.horizon, errors.windows, errors.nominal, black_box.completed, black_box.noise_floor)


def diagnosis(answer: Answer, errors: FitErrors, case: Problem) -> dict[str, object]:
    """What a baseline can fill of diagnosis.json, contract section 5; it has no intervals and no probabilities."""
    plant = case.nominal.plant
    total = sum(found.weight for found in answer.found) or 1.0
    sites: dict[str, float] = {}
    for found in answer.found:
        site = found.name.partition("/")[0]
        sites[site] = sites.get(site, 0.0) + found.weight / total
    return {
        "schema": 1,
        "verdict": "mismatch" if answer.mismatch else "consistent",
        "effects": [
            _effect(found, effect_of(found.name, plant), plant, found.weight / total) for found in answer.found
        ],
        "location": {"sites": sites, "regions": _regions(answer), "times": _times(answer, case)},
        "fit": {
            "horizon_s": errors.horizon,
            "train": {
                "nominal": dict(errors.nominal),
                "completed": dict(errors.completed),
                "noise_floor": dict(errors.noise_floor),
            },
        },
        "unexplained": {"significant": False, "p_value": None, "site": None},
        "identifiability": {"weak": [], "next_experiment": None},
        "notes": list(answer.notes),
    }


def _regions(answer: Answer) -> list[dict[str, object]]:
    """Where effects are that act on a stretch of their joint's way."""
    plant, regions = answer.model.plant, []
    for found in answer.found:
        ends = kind_of(found.name).stretch
        if ends is not None:
            signal = plant.columns[plant.joint_at(found.name.partition("/")[0])]
            low, high = (found.parameters[symbol] for symbol in ends)
            regions.append({"signal": signal, "low": low, "high": high, "share": 1.0})
    return regions


def _times(answer: Answer, case: Problem) -> list[dict[str, object]]:
    """From when on an effect acts that begins during the recordings, in each."""
    begins = [(found, kind_of(found.name).begins) for found in answer.found]
    events = [found.parameters[symbol] for found, symbol in begins if symbol]
    return [
        {"low": t0, "high": float(recording.t[-1]), "share": 1.0, "recording": recording.name}
        for t0 in events
        for recording in case.recordings
        if t0 < recording.t[-1]
    ]


def _effect(found: Found, effect: Effect, plant: Plant, share: float) -> Mapping[str, object]:
    angular = plant.is_angular(found.name.partition("/")[0])
    units = {p.name: p.unit(angular=angular) for p in effect.parameters}
    return {
        "name": found.name,
        "parameters": {
            symbol: {"value": value, "ci95": [None, None], "unit": units[symbol]}
            for symbol, value in found.parameters.items()
        },
        "equivalent": list(found.equivalent),
        "share": share,
    }


def _note(job: Job, folder: Path, data: DataNote, answer: Answer, errors: FitErrors, seconds: float) -> None:
    plant = answer.model.plant
    figures = error_metrics({"fit": errors}, plant)
    figures |= parameter_metrics({f"{f.name}.{s}": v for f in answer.found for s, v in f.parameters.items()}, plant)
    figures["baseline/time in s"] = seconds
    named = ", ".join(found.name for found in answer.found) or "none"
    tags = {"plant": plant.kind, "verdict": "mismatch" if answer.mismatch else "consistent", "effects": named}
    note_run(job, folder, data.name, metrics=figures, tags=tags, data=[data])
