"""Which evidence names missing physics where no law holds exactly: criteria compared on the same recordings.

    python -m wipx.proof.blind_robots.dirty --cases 24 --seed 7 --lengths 5 9 --out runs/dirty_dev
    python benchmarks/criteria.py --rigs --drawn runs/dirty_dev --out runs/criteria

Every criterion drives the same search. The numbers of what it names are then fitted in the same way, so that only the
names differ. A rerun goes on where the last one ended.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate
from omegaconf import OmegaConf

from wipx.config import register
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.decision.context import HORIZON, Context
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.forecasts import HORIZONS, ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.pipeline import in_two
from wipx.diagnosis.rules import USUAL
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.proof.blind_robots.dirty_score import alike
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator

CONF = Path(__file__).resolve().parent.parent / "conf"


class HalfSecond(ForecastFitter):
    """Predictions of half a second alone."""

    horizons = HORIZONS[-1:]


class NotHeldOut(ForecastFitter):
    """All horizons; evidence is that of the recordings that were fitted, with the penalty of the sandwich."""

    def required_beyond_penalty(self, smaller: Fit, larger: Fit, explained: float) -> float:
        """So much that no search over many effects finds it by chance."""
        return self.rules.selection.least_gain

    def holds(self, smaller: Fit, larger: Fit) -> bool:
        """Always."""
        return True


@dataclass(frozen=True)
class Case:
    """Recordings of one robot.

    Attributes:
        name: Of the robot.
        nominal: What its owner believes.
        uncertainty: Relative standard deviation of numbers that are not exact.
        seen: What a criterion may read.
        unseen: What it is judged by.
        missing: What is missing, each with other laws of the same physics.
        plausible: Effects that are not wrong either.
    """

    name: str
    nominal: Model
    uncertainty: Mapping[str, float]
    seen: tuple[Recording, ...]
    unseen: tuple[Recording, ...]
    missing: Mapping[str, tuple[str, ...]]
    plausible: tuple[str, ...] = ()

    @property
    def context(self) -> Context:
        """The means of a diagnosis."""
        halves = in_two(self.seen)
        setting = Setting(self.nominal, self.uncertainty, scales_of(self.nominal, halves))
        return Context.of(halves, setting, AnalyticSimulator(threads=1), USUAL)

    def error(self, model: Model) -> float:
        """Root mean square error over half a second on what was not seen, over the nominal model's."""
        judge = Judge(AnalyticSimulator(threads=1), sensor_noise(self.seen, self.nominal.plant), HORIZON)
        nominal, completed = judge.tuned(self.nominal, self.seen), judge.tuned(model, self.seen)
        errors = judge.compare(nominal, completed, self.unseen, held_out=True)[0]
        return float(np.sqrt(np.mean([(errors.completed[n] / errors.nominal[n]) ** 2 for n in errors.nominal])))


def by_forecasts(kind: type[ForecastFitter], context: Context, setting: Setting) -> ForecastFitter:
    """Forecasts beside the noise that innovations find for the nominal model."""
    by_row = context.by_row
    seen = by_row.converged(by_row.fit(Hypothesis.of(context.setting, (), {}), context.first_levels))
    return kind(by_row, context.first_levels, seen.levels, setting)


def ahead(kind: type[ForecastFitter], *, doubted: bool) -> Callable[[Context], Fitter]:
    """A criterion of forecasts, with the owner's exact numbers in doubt or not."""
    return lambda i: by_forecasts(kind, i, i.setting.doubted(i.rules.forecasts.undeclared) if doubted else i.setting)


CRITERIA: Mapping[str, Callable[[Context], Fitter]] = {
    "one row ahead": lambda context: context.by_row,
    "half a second ahead, held out, numbers in doubt": ahead(HalfSecond, doubted=True),
    "four horizons, not held out": ahead(NotHeldOut, doubted=False),
    "four horizons, held out": ahead(ForecastFitter, doubted=False),
    "four horizons, held out, numbers in doubt": ahead(ForecastFitter, doubted=True),
}


def drawn(folder: Path) -> Iterator[Case]:
    """Robots that `wipx.proof.blind_robots.dirty` has drawn."""
    for place in sorted(folder.glob("case*")):
        truth = json.loads((place / "answer.json").read_text(encoding="utf-8"))
        source = RecordingSource(path=str(place / "visible"))
        later = RecordingSource(path=str(place / "unseen"))
        robot = source.describe()
        missing = {effect["name"]: () for effect in truth["effects"]}
        name = f"{folder.name}/{place.name}"
        yield Case(name, robot.model, robot.uncertainty, source.load(), later.load(), missing)


def rigs() -> Iterator[Case]:
    """The rigs of `+experiment=real_recordings`, with their split."""
    register()
    with initialize_config_dir(str(CONF), version_base=None):
        composed = compose("config", overrides=["+experiment=real_recordings"]).task
    task: Any = OmegaConf.to_container(composed, resolve=True)
    for name, settings in task["cases"].items():
        case = instantiate(
            {"_target_": "wipx.proof.real_machines.recordings.Rig", **settings}, _recursive_=False, _convert_="all"
        )
        source = case.of(instantiate(task["sources"][settings["dataset"]], _convert_="all"))
        published = instantiate(settings["published"], _convert_="all")
        split, robot = source.split(source.load()), source.describe()
        missing = {main: published.same_physics(main) for main in published.main}
        plausible = (*published.known, *published.plausible)
        yield Case(str(name), robot.model, robot.uncertainty, split.fit, split.held_out, missing, plausible)


def searched(context: Context, fitter: Fitter) -> tuple[str, ...]:
    """Effects that a search by one criterion ends with."""
    start = Hypothesis.of(context.setting, (), {})
    if isinstance(fitter, ForecastFitter):
        nominal = fitter.first_fit(start)
    else:
        nominal = fitter.converged(fitter.fit(start, context.first_levels))
    return Search.of(FitStore.of(fitter, context.setting, nominal), nominal).run().fit.effects


def refitted(context: Context, effects: tuple[str, ...]) -> Model:
    """The nominal model with effects, fitted to forecasts from where screening has the best of each in turn."""
    fitter = by_forecasts(ForecastFitter, context, context.setting)
    fit = fitter.first_fit(Hypothesis.of(context.setting, (), {}))
    store = FitStore.of(fitter, context.setting, fit)
    for effect in effects:
        starts = [each for each in store.candidates_for(fit) if each.effect == effect]
        values = {**fit.hypothesis.values, **(starts[0].values if starts else {})}
        begun = Hypothesis.of(context.setting, (*fit.effects, effect), values)
        fit = fitter.converged(fitter.fit(begun, fit.levels))
    return fit.hypothesis.model


def judged(case: Case, context: Context, criterion: str, reference: float) -> dict[str, Any]:
    """What one criterion makes of a robot."""
    begun = time.process_time()
    try:
        effects = searched(context, CRITERIA[criterion](context))
    except np.linalg.LinAlgError:
        effects = ()
    seconds = time.process_time() - begun
    left = list(effects)
    named = [name for name in case.missing if name in left]
    left = [name for name in left if name not in named]
    kin = 0
    for name in case.missing:
        laws = case.missing[name]
        other = next((one for one in left if one in laws or alike(name, one)), None)
        if name not in named and other is not None:
            left.remove(other)
            kin += 1
    error = case.error(refitted(context, effects)) if effects else 1.0
    return {
        "case": case.name,
        "criterion": criterion,
        "effects": effects,
        "missing": len(case.missing),
        "named": len(named),
        "kin": kin,
        "others": len([name for name in left if name not in case.plausible]),
        "over_reference": error / reference,
        "seconds": seconds,
    }


def table(results: list[dict[str, Any]]) -> str:
    """One row for each criterion, Markdown."""
    rows = [
        "| criterion | named | same physics | others | dirt only: named | error: median | mean | worst | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for criterion in CRITERIA:
        own = [r for r in results if r["criterion"] == criterion]
        if not own:
            continue
        some, clean = [r for r in own if r["missing"]], [r for r in own if not r["missing"]]
        errors = [r["over_reference"] for r in some] or [np.nan]
        missing = sum(r["missing"] for r in some)
        cells = [
            criterion,
            f"{sum(r['named'] for r in some)} of {missing}",
            str(sum(r["kin"] for r in some)),
            str(sum(r["others"] for r in some)),
            f"{sum(bool(r['effects']) for r in clean)} of {len(clean)}",
            f"{np.median(errors):.2f}",
            f"{np.exp(np.mean(np.log(errors))):.2f}",
            f"{np.max(errors):.1f}",
            f"{np.median([r['seconds'] for r in own]):.0f}",
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def main() -> None:
    """Compare, robot by robot."""
    parser = argparse.ArgumentParser(description="Compare criteria on the same recordings.")
    parser.add_argument("--rigs", action="store_true", help="the rigs of +experiment=real_recordings")
    parser.add_argument("--drawn", type=Path, nargs="*", default=[], help="folders of `wipx.proof.blind_robots.dirty`")
    parser.add_argument("--only", nargs="*", default=[], help="names of rigs; all without it")
    parser.add_argument("--out", type=Path, required=True, help="folder that takes the results")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    kept = arguments.out / "results.jsonl"
    results = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    done = {(result["case"], result["criterion"]) for result in results}
    wanted = [case for case in rigs() if case.name in arguments.only or not arguments.only] if arguments.rigs else []
    cases = [*wanted, *(case for folder in arguments.drawn for case in drawn(folder))]
    for number, case in enumerate(cases, start=1):
        left = [criterion for criterion in CRITERIA if (case.name, criterion) not in done]
        if not left:
            continue
        context = case.context
        reference = case.error(refitted(context, tuple(case.missing))) if case.missing else 1.0
        for criterion in left:
            result = judged(case, context, criterion, reference)
            results.append(result)
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(result) + "\n")
            print(f"[{number}/{len(cases)}] {case.name}: {criterion}: {', '.join(result['effects']) or 'nothing'}")
    parts = {
        "Rigs": [result for result in results if "/" not in result["case"]],
        "Dirty robots": [result for result in results if "/" in result["case"]],
    }
    summary = "\n\n".join(f"{title}\n\n{table(part)}" for title, part in parts.items() if part)
    (arguments.out / "table.md").write_text(summary + "\n", encoding="utf-8")
    print(summary)


if __name__ == "__main__":
    main()
