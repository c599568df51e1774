"""Cases on disk: FOLDER/visible, FOLDER/unseen in the format of contract section 1, and FOLDER/truth.json."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np
import yaml

from wipx.concealed.cases import TIERS, Case, draw_case
from wipx.concealed.logging import Run
from wipx.core.errors import unknown_name

TRUTH = "truth.json"


def write_cases(folder: Path, *, seed: int, cases: int, tiers: tuple[str, ...] = tuple(TIERS)) -> tuple[Path, ...]:
    """Draw cases and write each to a folder of its own; returns the folders.

    The same seed gives the same cases, whatever their number.

    Args:
        folder: Takes one folder for each case.
        seed: Of every random number.
        cases: How many.
        tiers: Those that may be drawn, keys of `TIERS`.

    Raises:
        InputError: a tier does not exist.
    """
    return tuple(write_numbered(folder, seed, number, tiers) for number in range(1, cases + 1))


def write_numbered(folder: Path, seed: int, number: int, tiers: tuple[str, ...]) -> Path:
    """Draw case `number` of a seed and write it to a folder named after the number; returns that folder."""
    for tier in tiers:
        if tier not in TIERS:
            raise unknown_name("tier", tier, TIERS, "tiers")
    place = folder / f"case{number:04d}"
    if not (place / TRUTH).is_file():
        write_case(draw_case(np.random.default_rng([seed, number]), tiers), place)
    return place


def write_case(case: Case, folder: Path) -> None:
    """Write one case; truth.json last, so that a folder that has it is whole."""
    for name, runs in (("visible", case.visible), ("unseen", case.unseen)):
        (folder / name).mkdir(parents=True, exist_ok=True)
        text = yaml.safe_dump(robot_file(case), sort_keys=False)
        (folder / name / "robot.yaml").write_text(text, encoding="utf-8")
        for number, run in enumerate(runs, start=1):
            _write_run(folder / name / f"r{number}.csv", run)
    (folder / TRUTH).write_text(json.dumps(truth(case), indent=2) + "\n", encoding="utf-8")


def robot_file(case: Case) -> dict[str, object]:
    """Content of robot.yaml: what the owner believes."""
    robot = case.robot
    content: dict[str, object] = {"plant": robot.kind, "parameters": dict(robot.parameters)}
    if case.uncertainty:
        content["uncertainty"] = dict(case.uncertainty)
    if case.known:
        content["effects"] = {name: dict(values) for name, values in case.known.items()}
    content["controller"] = {"kind": "lqr", "gains": robot.written_gains, "rate": robot.rate}
    return content


def truth(case: Case) -> dict[str, object]:
    """Content of truth.json: what is hidden, where and when it acts, and how the runs were made."""
    hidden, shown = case.hidden, len(case.visible)
    oddity = hidden.oddity
    return {
        "schema": 1,
        "tier": case.tier,
        "plant": case.robot.kind,
        "effects": [{"name": name, "parameters": dict(values)} for name, values in hidden.effects.items()],
        "outside": None if oddity is None else {"name": oddity.name, "joint": oddity.joint, **oddity.values},
        "regions": [
            {"signal": "x", "low": values["lo"], "high": values["hi"]}
            for name, values in hidden.effects.items()
            if name.endswith("/sticky_spot")
        ],
        "times": _times(hidden.effects, case.visible),
        "true_parameters": {name: case.parameters[name] for name in case.uncertainty},
        "noise": case.noise(),
        "contrast": {name: dict(signals) for name, signals in case.contrast.items()},
        "logging": {
            **asdict(case.settings),
            "excitations": {"visible": case.excitations[:shown], "unseen": case.excitations[shown:]},
        },
    }


def _times(effects: Mapping[str, Mapping[str, float]], runs: tuple[Run, ...]) -> list[dict[str, object]]:
    """When an event acts in each visible recording."""
    if "geometry/payload_event" not in effects:
        return []
    begin = effects["geometry/payload_event"]["t0"]
    ends = [float(run.columns["t"][-1]) for run in runs]
    return [{"low": begin, "high": end, "recording": f"r{i}.csv"} for i, end in enumerate(ends, start=1)]


def _write_run(path: Path, run: Run) -> None:
    columns = [values.tolist() for values in run.columns.values()]
    rows = (",".join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([",".join(run.columns), *rows]) + "\n", encoding="utf-8")
