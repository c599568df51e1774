"""Cases with many joints as the texts of files: recordings as contract section 6 has them, and the truth."""

from dataclasses import asdict
from typing import Any

import yaml

from wipx.proof.blind_robots.trees.cases import Case
from wipx.proof.blind_robots.trees.files import model_file, model_name, robot_file
from wipx.proof.blind_robots.trees.logging import Run
from wipx.proof.blind_robots.write import CaseFiles, table


def tree_files(case: Case) -> CaseFiles:
    """The files of a case."""
    robot = yaml.safe_dump(robot_file(case.robot, case.known, case.uncertainty), sort_keys=False)
    own = {"robot.yaml": robot, model_name(case.robot): model_file(case.robot)}
    visible, unseen = (_with_recordings(own, runs) for runs in (case.visible, case.unseen))
    return CaseFiles(visible, unseen, truth(case))


def _with_recordings(own: dict[str, str], runs: tuple[Run, ...]) -> dict[str, str]:
    return {**own, **{f"r{number}.csv": table(run.columns) for number, run in enumerate(runs, start=1)}}


def truth(case: Case) -> dict[str, Any]:
    """What is hidden, where it acts, and how the runs were made."""
    hidden, shown, robot = case.hidden, len(case.visible), case.robot
    unmodelled = hidden.unmodelled
    return {
        "schema": 1,
        "tier": case.tier,
        "plant": f"{len(robot.links)} joints",
        "joints": {
            link.joint: {"body": link.body, "drive": drive.kind}
            for link, drive in zip(robot.links, robot.drives, strict=True)
        },
        "effects": [{"name": name, "parameters": dict(values)} for name, values in hidden.effects.items()],
        "known": list(case.known),
        "outside": None
        if unmodelled is None
        else {"name": unmodelled.name, "joint": robot.joints[unmodelled.joint], **unmodelled.values},
        "regions": [
            {"signal": name.partition("/")[0], "low": values["lo"], "high": values["hi"]}
            for name, values in hidden.effects.items()
            if name.endswith("/sticky_spot")
        ],
        "times": [],
        "true_parameters": dict(case.parameters),
        "noise": case.noise(),
        "dirt": None,
        "contrast": {name: dict(signals) for name, signals in case.contrast.items()},
        "logging": {
            **asdict(case.settings),
            "rate": robot.rate,
            "excitations": {"visible": case.excitations[:shown], "unseen": case.excitations[shown:]},
        },
    }
