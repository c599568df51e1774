"""task=margins: controllers compared from the command line, and robots and settings that are refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from tasks.conftest import Program, RecordingFolder

from wipx.core.margins import Margins, Recovery, RecoveryRegion
from wipx.report.margins_table import margins_table

QUICK = (
    "+experiment=margins",
    "method=pure_sim",
    "estimator=momentum_observer",
    "sim@target.engine=analytic",
    "target.engine.step=1e-3",
    "sim.threads=1",
    "task.dataset.samples=100",
    "task.dataset.checked=1",
    "task.dataset.per_load=1",
    "~task.controllers.lqi",
    "~task.controllers.mpc",
    "~task.controllers.mpc_offset_free",
    "task.releases.masses=[1.2]",
    "task.releases.pitches=[-0.14]",
    "task.releases.rail=2.0",
    "task.releases.duration=4",
    "task.releases.end=1",
    "hydra.run.dir=out",
)


@pytest.mark.slow
def test_margins_and_recovered_loads_come_from_the_command_line_once(program: Program, tmp_path: Path):
    another = "+controller@task.controllers.adaptive=lqr_equilibrium_adaptive"
    answer = program(*QUICK, another)
    assert answer.status == 0, answer.error
    assert answer.out.count("\n") == 1
    assert "margins of 4 controllers" in answer.out
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"result.json", "table.md", "margins.png", "recovery.png", "model.yaml"} <= written
    result = json.loads((tmp_path / "out" / "result.json").read_text())["result"]
    regions = result["region"]["controllers"]
    assert regions["lqr"]["recovered"] == [[False]]  # it would stand theta_eq K_theta / K_x = 2.5 m away
    assert regions["pid"]["recovered"] == regions["lqr_equilibrium"]["recovered"] == [[True]]
    assert [name for name, found in result["margins"].items() if found["inner"]] == ["lqr_equilibrium", "adaptive"]
    assert result["margins"]["lqr"]["phase"] == pytest.approx(np.deg2rad(60.0), abs=0.05)
    assert "finished before" in program(*QUICK, another).out
    assert "made with other settings" in program(*QUICK).error
    elsewhere = [argument for argument in QUICK if not argument.startswith("hydra.run.dir=")]
    slow = program(*elsewhere, "task.controllers.pid.rate=3", "hydra.run.dir=slow")
    assert slow.status == 2
    assert "task.controllers.pid: its gains do not stabilise the model" in slow.error


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("task.length=81", "task.length is 81, expected 2 to 80"),
        ("task.releases.pitches=[0.1,0.0]", "releases.pitches is [0.1, 0.0], expected ascending numbers; sort them"),
        ("task.releases.rial=2", "unknown key 'rial'; did you mean rail?"),
        ("task.controllers.pid.lean=-1", "lean"),
        ("~task.controllers", "task.controllers is empty; add one, +controller@task.controllers.lqr=lqr"),
        ("controller=pid", "use controller=lqr"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(program: Program, tmp_path: Path, argument: str, message: str):
    kept = [other for other in QUICK if other.partition("=")[0] != argument.partition("=")[0]]
    answer = program(*kept, argument)
    assert answer.status == 2
    assert message in answer.error
    assert answer.error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_robot_without_carriage_is_refused(program: Program, folder: RecordingFolder):
    own = (argument for argument in QUICK if not argument.startswith(("target.", "sim@target.")))
    answer = program(*own, "target=recordings", f"target.path={folder.path}")
    assert answer.status == 2
    assert answer.error == (
        "task=margins releases loaded robots: it needs a body that balances on wheels or on a cart, got a pendulum; "
        "choose another target\n"
    )


def test_the_table_says_up_to_which_load_all_masses_recover():
    lost, stands = np.nan, 0.2
    standing = np.array([[lost, stands, 0.0, stands, stands], [stands, stands, 0.0, 0.1, lost]])
    region = RecoveryRegion(
        masses=np.array([0.8, 1.6]),
        pitches=np.array([-0.2, -0.1, 0.0, 0.1, 0.2]),
        height=0.5,
        rail=2.25,
        duration=8.0,
        controllers={
            "some": Recovery(np.isfinite(standing), np.ones_like(standing), standing),
            "none": Recovery(np.zeros((2, 5), bool), np.ones((2, 5)), np.full((2, 5), np.nan)),
        },
    )
    found = {"some": Margins(0.5, np.inf, np.pi / 3.0, 0.05, inner=True), "none": Margins(0.0, 9.0, 1.0, np.inf)}
    lines = margins_table(found, region).splitlines()
    assert lines[2] == "| some (inner loop) | 0.50 to inf | 60.0 | 50.0 | 80 | +-0.1 | 0.200 |"
    assert lines[3] == "| none | 0 to 9.0 | 57.3 | any | 0 | - | - |"
    assert "Those of some are of the inner loop" in lines[-1]
