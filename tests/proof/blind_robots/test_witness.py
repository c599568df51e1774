"""A watched program opens what it may, and every file that it asks for is noted."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wipx.proof.blind_robots.witness import READ, REFUSED, Settings, hook


@pytest.fixture
def rules(tmp_path: Path) -> Settings:
    root = Path(os.path.realpath(tmp_path))
    return Settings((str(root / "run"),), (str(root / "run" / "recordings" / "case0001"),), str(root / "log"))


def test_only_the_own_case_of_a_run_may_be_opened(rules: Settings):
    run = rules.guarded[0]
    assert rules.permits(f"{run}/recordings/case0001/r1.csv")
    assert rules.permits("/usr/lib/python3/os.py")
    for sealed in ("sealed/case0001.seal", "recordings/case0002/r1.csv", "recordings/case00012/r1.csv", "keys.json"):
        assert not rules.permits(f"{run}/{sealed}")


def test_the_memory_of_other_processes_may_not_be_opened(rules: Settings):
    assert rules.permits(f"/proc/{os.getpid()}/maps")
    assert rules.permits("/proc/cpuinfo")
    assert not rules.permits(f"/proc/{os.getppid()}/mem")


def test_the_hook_notes_and_refuses(rules: Settings):
    noted: list[tuple[str, str]] = []
    watch = hook(rules, lambda what, path: noted.append((what, path)))
    watch("open", (3, "r", 0))  # a descriptor
    watch("open", (rules.allowed[0].encode(), "r", 0))
    for event, asked in (("open", f"{rules.guarded[0]}/a"), ("os.rename", f"{rules.guarded[0]}/a")):
        with pytest.raises(PermissionError, match="sealed while physics is hidden"):
            watch(event, (asked, "elsewhere", 0))
    with pytest.raises(PermissionError, match="without other processes"):
        watch("subprocess.Popen", ("cat", [], None, None))
    assert [what for what, _ in noted] == [READ, REFUSED, REFUSED, REFUSED]


def test_a_link_does_not_lead_around_the_rules(rules: Settings, tmp_path: Path):
    watch = hook(rules, lambda what, path: None)
    (tmp_path / "run").mkdir()
    (tmp_path / "way").symlink_to(tmp_path / "run")
    with pytest.raises(PermissionError):
        watch("open", (tmp_path / "way" / "keys.json", "r", 0))


@pytest.mark.slow
def test_the_program_cannot_read_the_recordings_of_another_case(tmp_path: Path):
    other = tmp_path / "run" / "recordings" / "case0002"
    other.mkdir(parents=True)
    (other / "robot.yaml").write_text("plant: wip\n")
    (other / "r1.csv").write_text("t,x,u\n0,0,0\n")
    done, noted = watched(tmp_path, other, guarded=tmp_path / "run")
    assert done.returncode != 0
    assert f"{REFUSED} {os.path.realpath(other)}" in noted


@pytest.mark.slow
def test_a_robot_from_a_model_file_starts_no_process(tmp_path: Path):
    robot = tmp_path / "robot"
    robot.mkdir()
    link = '<joint name="hinge"/><inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.01"/>'
    (robot / "robot.xml").write_text(f"<mujoco><worldbody><body>{link}</body></worldbody></mujoco>")
    (robot / "robot.yaml").write_text("plant: robot\nmodel: robot.xml\n")
    (robot / "r1.csv").write_text("t,hinge\n0,0\n0.1,0\n")
    done, noted = watched(tmp_path, robot, guarded=tmp_path / "run")
    assert "u_hinge" in done.stderr, done.stderr  # a column is missing: the model file was read
    assert REFUSED not in noted


def watched(tmp_path: Path, recordings: Path, *, guarded: Path) -> tuple[subprocess.CompletedProcess[str], str]:
    """`task=diagnose` of some recordings under the witness, and what this noted."""
    given = {"guarded": [str(guarded)], "allowed": [], "log": str(tmp_path / "log.txt")}
    command = [sys.executable, "-m", "wipx.proof.blind_robots.witness", json.dumps(given), "task=diagnose"]
    places = ["tracking=none", f"recordings.path='{recordings}'", f"hydra.run.dir='{tmp_path / 'out'}'"]
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run([*command, *places], capture_output=True, text=True, timeout=60, check=False, env=environment)
    return done, (tmp_path / "log.txt").read_text()
