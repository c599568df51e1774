"""Cases as the texts of files: recordings in the format of contract section 1, and the truth."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from wipx.proof.blind_robots.cases import Case
from wipx.proof.blind_robots.logging import Run


@dataclass(frozen=True)
class CaseFiles:
    """A case on its way to disk.

    Attributes:
        visible: Texts of robot.yaml and of the recordings that a diagnosis may read, by file name.
        unseen: The same of the recordings that only the judging sees.
        truth: What is hidden, see `truth`.
    """

    visible: Mapping[str, str]
    unseen: Mapping[str, str]
    truth: Mapping[str, Any]


def case_files(case: Case) -> CaseFiles:
    """The files of a case."""
    robot = {"robot.yaml": yaml.safe_dump(robot_file(case), sort_keys=False)}
    visible, unseen = (
        {**robot, **{f"r{number}.csv": table(run.columns) for number, run in enumerate(runs, start=1)}}
        for runs in (case.visible, case.unseen)
    )
    return CaseFiles(visible, unseen, truth(case))


def write_files(folder: Path, files: Mapping[str, str]) -> None:
    """Write texts to a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_bytes(text.encode("utf-8"))  # the very bytes that a commitment is made to


def robot_file(case: Case) -> dict[str, object]:
    """Content of robot.yaml: what the owner believes."""
    robot = case.robot
    content: dict[str, object] = {"plant": robot.kind, "parameters": dict(robot.parameters)}
    if case.uncertainty:
        content["uncertainty"] = dict(case.uncertainty)
    if case.known:
        content["effects"] = {name: dict(values) for name, values in case.known.items()}
    if robot.gains.any():
        content["controller"] = {"kind": "lqr", "gains": robot.written_gains, "rate": robot.rate}
    return content


def truth(case: Case) -> dict[str, Any]:
    """What is hidden, where and when it acts, and how the runs were made."""
    hidden, shown = case.hidden, len(case.visible)
    unmodelled = hidden.unmodelled
    return {
        "schema": 1,
        "tier": case.tier,
        "plant": case.robot.kind,
        "effects": [{"name": name, "parameters": dict(values)} for name, values in hidden.effects.items()],
        "known": list(case.known),
        "outside": None
        if unmodelled is None
        else {"name": unmodelled.name, "joint": unmodelled.joint, **unmodelled.values},
        "regions": [
            {"signal": "x", "low": values["lo"], "high": values["hi"]}
            for name, values in hidden.effects.items()
            if name.endswith("/sticky_spot")
        ],
        "times": _times(hidden.effects, case.visible),
        "true_parameters": {name: case.parameters[name] for name in case.uncertainty},
        "noise": case.noise(),
        "dirt": None if case.dirt is None else dict(case.dirt),
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


def table(columns: Mapping[str, np.ndarray]) -> str:
    """Columns of a recording, each of shape (rows,), as CSV."""
    values = [column.tolist() for column in columns.values()]
    rows = (",".join(f"{value:.10g}" for value in row) for row in zip(*values, strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"
