"""`task=real_recordings`: recordings of real hardware, diagnosed without what their authors know."""

import json
from pathlib import Path

import numpy as np
import pytest

from wipx.core.diagnosis import FoundEffect
from wipx.core.recording import Recording
from wipx.core.results import Estimate
from wipx.core.suspect import Suspect, SuspectedSize
from wipx.proof.baseline_answers import MethodAnswer, NamedEffect
from wipx.proof.real_machines.published import Published
from wipx.proof.real_machines.recordings import only
from wipx.proof.real_machines.recordings_table import HEAD, Outcome, asked, cells, markdown, score
from wipx.recordings.source import RecordingSource

RESULTS = {
    "authors.yaml",
    "diagnosis.json",
    "diagnosis.png",
    "heldout.json",
    "heldout.png",
    "model.yaml",
    "report.html",
}


def found(name: str, *equivalent: str) -> FoundEffect:
    return FoundEffect(name, "", "", False, (), equivalent, (), 100.0, 0.9, 0.99, 1.0, None)


def test_a_tie_is_told_from_a_name():
    known = {"pitch/coulomb": "F_c = 1 N m", "actuator/offset": "-0.1 N m"}
    effects = (found("pitch/coulomb"), found("sensor_theta/bias", "actuator/offset"), found("actuator/delay"))
    assert score(known, effects) == "1 of 2, 1 tied, 2 beside"


def test_nothing_found_names_nothing():
    assert score({"pitch/coulomb": "F_c = 1 N m"}, ()) == "0 of 1"


def test_a_refusal_stays_in_the_table():
    refused = Outcome(
        "Rig", Published({"pitch/coulomb": "F_c = 1 N m"}), None, (), "the recordings contradict its sign of u"
    )
    assert cells(refused)[2] == "no answer: the recordings contradict its sign of u"
    head, rule, row = markdown([refused]).splitlines()
    assert head.count("|") == rule.count("|") == row.count("|") == len(HEAD) + 1


def test_other_methods_stand_beside_the_answer():
    published = Published({"pitch/coulomb": "F_c = 1 N m"}, main={"pitch/coulomb": ["stribeck"]})
    ours = MethodAnswer("wipx", (NamedEffect("pitch/coulomb"),), {"theta": 0.01}, 17.0)
    other = MethodAnswer("regression", (NamedEffect("actuator/lag"),), {"theta": 0.02}, 3.0)
    failed = MethodAnswer("paper", refusal="too short")
    table = markdown([Outcome("Rig", published, None, (), "", (ours, other, failed), {"theta": "rad"})])
    assert "| Rig | wipx | pitch/coulomb | 1 of 1 | 0 | theta 0.01 rad | 17 |" in table
    assert "| Rig | regression | actuator/lag | 0 of 1 | 1 | theta 0.02 rad | 3 |" in table
    assert "| Rig | paper | no answer: too short | - | - | - | - |" in table


def suspect(*, named: bool, gain: float, size: SuspectedSize | None, in_place_of: tuple[str, ...] = ()) -> Suspect:
    level = Estimate("pitch/coulomb.F_c", "N m", 0.0, 0.21, 0.15, 0.27, False, "Coulomb level")
    return Suspect("pitch/coulomb", named, in_place_of, (level,), gain, 43.0, 0.1, True, 0.0, size)


def test_a_cell_says_what_came_of_the_authors_figure():
    def size(loss: float, *, excluded: bool, free: bool) -> SuspectedSize:
        return SuspectedSize({"F_c": 0.289}, loss, loss, free, 2.0, excluded, 3.1)

    shown = "F_c = 0.21 N m [0.15, 0.27]"
    agrees = suspect(named=True, gain=90.0, size=size(0.4, excluded=False, free=True))
    assert asked(agrees) == f"pitch/coulomb: named, size agrees: 0.4 nats worse; {shown}"
    excluded = suspect(named=False, gain=24.0, size=size(230.0, excluded=True, free=False))
    assert asked(excluded) == f"pitch/coulomb: not named, excluded: 230 nats worse, held-out error 3.1 times; {shown}"
    unknown = suspect(named=False, gain=24.0, size=size(1.3, excluded=False, free=False))
    assert asked(unknown) == f"pitch/coulomb: not named, not excluded: 1.3 nats worse; {shown}"
    instead = suspect(named=False, gain=24.0, size=None, in_place_of=("pitch/presliding",))
    assert asked(instead) == f"pitch/coulomb in place of pitch/presliding: gains 24.0 nats of 43.0; {shown}"


def test_the_diagnosis_is_given_the_rows_to_fit_alone(folder):
    source = RecordingSource(path=str(folder.path), held_out=0.3)
    split = source.split(source.load())
    seen = only(source, split.fit).load()
    assert [r.name for r in seen] == [r.name for r in split.fit]
    for loaded, fit in zip(seen, split.fit, strict=True):
        np.testing.assert_array_equal(loaded.t, fit.t)
    held = only(source, split.held_out).load()
    assert isinstance(held[0], Recording)
    assert held[0].t[0] > seen[0].t[-1]


def test_an_unknown_case_is_refused(program):
    answer = program("+experiment=real_recordings", "task.only=[tuee]", "hydra.run.dir=out")
    assert answer.status == 2
    assert "did you mean tue?" in answer.error


@pytest.mark.parametrize(
    ("experiment", "folder", "parts"),
    [
        ("real_recordings", "WIPX_RECORDINGS", ("energy_shaping_swingup.csv", "xl330_*.csv", "github.com/Rhoban/bam")),
        ("real_arms", "WIPX_ARMS", ("kuka_kr300: visible/*.csv", "github.com/unisa-acg/inverse-dynamics-solver")),
    ],
)
def test_missing_recordings_are_named_in_one_line_with_their_origins(
    program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, experiment: str, folder: str, parts: tuple[str, ...]
):
    monkeypatch.setenv(folder, str(tmp_path / "nowhere"))
    answer = program(f"+experiment={experiment}", "hydra.run.dir=out")
    assert answer.status == 2
    assert len(answer.error.strip().splitlines()) == 1
    for part in (*parts, f"{folder}=FOLDER"):
        assert part in answer.error
    if experiment == "real_recordings":
        assert answer.error.count("github.com/pichim/Mini_Segway") == 2
    assert not (tmp_path / "out" / "table.md").exists()


@pytest.mark.slow
def test_a_real_pendulum_is_diagnosed_and_its_row_written(
    program, recordings_root: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    monkeypatch.setenv("WIPX_RECORDINGS", str(recordings_root))
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table: begin -->\nold\n<!-- table: end -->\nafter\n")
    chosen = ("task.only=[dfki]", f"task.page={page}")
    answer = program("+experiment=real_recordings", *chosen, "sim.threads=1", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert {path.name for path in (tmp_path / "out" / "dfki").iterdir()} >= RESULTS
    written = page.read_text()
    assert written.startswith("before\n")
    assert written.endswith("after\n")
    assert "old" not in written
    assert "Torque-limited pendulum (DFKI)" in written
    held_out = json.loads((tmp_path / "out" / "dfki" / "heldout.json").read_text())
    assert held_out["recordings"] == ["constant_torque_0p9Nm.csv"]
    (errors,) = held_out["errors"]
    assert errors["horizon"] == 0.5
    assert errors["noise_floor"]["theta"] < errors["completed"]["theta"]
    assert errors["noise_floor"]["theta"] < errors["authors"]["theta"]
    assert errors["completed"]["theta"] < 1.2 * errors["nominal"]["theta"]  # the decay says little of the swing-up
