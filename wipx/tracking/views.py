"""What MLflow shows of an experiment: columns of the list of runs, and charts; as the state of a shared view.

A shared view is what the button "Share" of MLflow's runs page leaves: a tag of the experiment that a link names.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

TABLE, CHARTS = "table", "charts"  # names of the shared views
TAG = "mlflow.sharedViewState."
PARENT = "mlflow.parentRunId"  # tag of a job: its sweep's run
SECTION = "comparison"


@dataclass(frozen=True)
class View:
    """What matters of the runs of one task.

    Attributes:
        options: Parameters by which runs differ, the most telling first; runs are compared by the first that varies.
        metrics: Shown as columns and as bars.
        courses: Metrics over steps, shown as lines.
        tags: Shown as columns.
    """

    options: tuple[str, ...] = ()
    metrics: tuple[str, ...] = ()
    courses: tuple[str, ...] = ()
    tags: tuple[str, ...] = ()


VIEWS = {
    "adapt": View(
        ("optimizer", "method", "sim", "seed"),
        ("fit/loss", "heldout/loss", "fit/floor", "search/evaluations", "search/time in s"),
        ("search/best_loss",),
    ),
    "train": View(
        ("estimator", "method", "task.length", "seed"),
        (
            "sim/rmse in rad",
            "real/rmse in rad",
            "real/coverage of 90 per cent",
            "estimate/time in ms",
            "training/time in s",
        ),
    ),
    "control": View(
        ("controller", "method", "task.scenario", "seed"),
        (
            "rmse/position in m",
            "rmse/pitch from balance in rad",
            "trials stopped",
            "trials recovered",
            "recovery/median time in s",
            "estimate/rmse in rad",
        ),
    ),
    "dataset": View(("method", "seed"), ("reality gap", "robots stopped")),
    "diagnose": View(
        ("seed",),
        ("effects found", "heldout/nominal/theta in rad", "heldout/completed/theta in rad"),
        (),
        ("plant", "verdict", "effects"),
    ),
    "baseline": View(("baseline",), ("fit/completed/theta in rad", "baseline/time in s"), (), ("verdict", "effects")),
    "identify": View(
        ("friction", "optimizer"),
        ("heldout/nominal/theta in rad", "heldout/completed/theta in rad"),
        ("search/best_loss",),
        ("plant", "effects"),
    ),
    "margins": View(
        ("method",),
        (
            "lqr/phase in deg",
            "lqr_equilibrium/phase in deg",
            "lqi/phase in deg",
            "mpc/phase in deg",
            "pid/phase in deg",
        ),
    ),
}  # by task


def compared_by(view: View, values: Mapping[str, Collection[str]]) -> str | None:
    """The option by which runs are compared: the first that has several values; None where none has.

    Args:
        view: Of the runs' task.
        values: Of each parameter, over the runs.
    """
    return next((name for name in view.options if len(set(values.get(name, ()))) > 1), None)


def view_states(
    view: View, metrics: Collection[str], compared: str | None, in_sweep: bool = False
) -> dict[str, dict[str, object]]:
    """States of the two shared views, by name.

    Args:
        view: What matters.
        metrics: Those that the runs have.
        compared: Option by whose values runs are averaged in charts; None for one bar a run.
        in_sweep: Whether the runs are jobs of a sweep. They are sorted by the first metric, since MLflow folds them
            away below the sweep's run where runs are sorted by time.
    """
    shown = [name for name in view.metrics if name in metrics]
    columns = [_key("params", name) for name in view.options]
    columns += [_key("tags", name) for name in view.tags]
    columns += [_key("metrics", name) for name in shown]
    everything: dict[str, object] = {"selectedColumns": ["attributes.`Duration`", "attributes.`Dataset`", *columns]}
    if in_sweep and shown:
        everything |= {"orderByKey": _key("metrics", shown[0]), "orderByAsc": True}
    bars = [_chart("BAR", i, {"metricKey": name, "displayName": name}) for i, name in enumerate(shown)]
    lines = [
        _chart("LINE", len(bars) + i, {"metricKey": name, "selectedMetricKeys": [name], "xAxisKey": "step"})
        for i, name in enumerate(name for name in view.courses if name in metrics)
    ]
    section = {"uuid": SECTION, "name": SECTION, "display": True, "isReordered": False, "deleted": False}
    charts = {
        **everything,
        "compareRunCharts": [*bars, *lines],
        "compareRunSections": [{**section, "isGenerated": False}],
        "groupBy": compared and {"aggregateFunction": "average", "groupByKeys": [_group(compared)]},
        "runsHiddenMode": "SHOW_ALL",
        "useGroupedValuesInCharts": True,
        "isAccordionReordered": False,
    }
    return {TABLE: everything, CHARTS: charts}


def _key(kind: str, name: str) -> str:
    return f"{kind}.`{name}`"


def _group(name: str) -> dict[str, str]:
    return {"mode": "param", "groupByData": name}


def _chart(kind: str, number: int, content: dict[str, object]) -> dict[str, object]:
    place = {"uuid": f"chart{number}", "type": kind, "metricSectionId": SECTION, "runsCountToCompare": 100}
    return {**place, "deleted": False, "isGenerated": False, **content}
