"""A whole run of the blind benchmark, with a quick stand-in for the diagnosis: from the seals to the check."""

import json
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.proof.blind import benchmark, diagnosing
from wipx.proof.blind.answering import BlindAnswer
from wipx.proof.blind.benchmark import BlindBenchmark
from wipx.proof.blind.check import BlindCheck
from wipx.proof.blind.diagnosing import OURS, Diagnosers, check_methods
from wipx.proof.blind_robots.folder import RunFolder
from wipx.proof.blind_robots.seal import Sealed
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.job import Job

pytestmark = pytest.mark.slow  # robots are drawn and sealed

CONSISTENT = {
    "schema": 1,
    "verdict": "consistent",
    "effects": [],
    "location": {"sites": {}, "regions": [], "times": []},
}
SEED = 8  # draws robots that stay up at once
TASK = BlindBenchmark(cases=2, seed=SEED, workers=1, tiers=("nothing",), baselines=("guess",), baselines_cases=1)


def job(out: Path) -> Job:
    out.mkdir(parents=True, exist_ok=True)
    return Job(out, 0, (), {}, {}, None, lambda group: None, lambda node, group: None, {})


@pytest.fixture(scope="module", autouse=True)
def guessing_is_a_method() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(benchmark, "check_methods", lambda methods: None)
        yield


def answered_nothing(self: Diagnosers, settings: str, arguments: list[str]) -> str:
    """Says of any recordings that the nominal model explains them."""
    recordings, out = (Path(text.partition("=")[2].strip("'")) for text in arguments[-2:])
    (out / "diagnosis.json").write_text(json.dumps(CONSISTENT))
    write_model(RecordingSource(path=str(recordings)).describe().model, out / "model.yaml")
    return "exit status 2: cannot guess" if "baseline=guess" in arguments else ""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run of two cases; a baseline gives no answer to one of them."""
    out = tmp_path_factory.mktemp("blind") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Diagnosers, "_watched", answered_nothing)
        TASK.run(job(out))
    return out


@pytest.fixture
def copy(finished: Path, tmp_path: Path) -> RunFolder:
    shutil.copytree(finished, tmp_path / "run")
    return RunFolder(tmp_path / "run")


def check(folder: RunFolder) -> None:
    BlindCheck(str(folder.path)).run(job(folder.path.parent / "check"))


def test_a_run_leaves_commitments_answers_and_a_page(finished: Path):
    names = {path.name for path in finished.iterdir()}
    parts = {"commitments.json", "recordings", "sealed", "answers", "opened"}
    assert names == parts | {"index.html", "score.md", "score.csv", "score.json", "confusions.png"}
    page = (finished / "index.html").read_text()
    assert "2 robots with hidden physics" in page
    assert "cannot guess" in page
    summary = json.loads((finished / "score.json").read_text())
    assert summary["cases"]["case0001"][OURS]["exact"]
    assert summary["cases"]["case0001"][OURS]["over_floor"] > 0.5
    assert summary["cases"]["case0001"]["guess"]["failure"] == "exit status 2: cannot guess"
    assert list(summary["cases"]["case0002"]) == [OURS]


def test_visible_files_do_not_tell_what_is_hidden(finished: Path):
    content = json.loads((finished / "commitments.json").read_text())
    assert set(content["cases"][0]) == {"case", "sealed", "recordings"}
    assert {path.name for path in (finished / "recordings" / "case0001").iterdir()} >= {"robot.yaml", "r1.csv"}
    assert "nothing" not in (finished / "recordings" / "case0001" / "robot.yaml").read_text()


def test_an_untouched_run_passes_the_check(copy: RunFolder, capsys: pytest.CaptureFixture[str]):
    check(copy)
    assert "2 of 2 cases" in capsys.readouterr().out


def changed(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ("sealed/case0002.seal", r"case0002\.seal: does not open"),
        ("recordings/case0001/r2.csv", r"recordings/case0001: not the recordings"),
        (f"answers/case0002/{OURS}/model.yaml", r"answers/case0002/wipx: changed after it was answered"),
    ],
)
def test_a_changed_file_is_noticed(copy: RunFolder, part: str, message: str):
    changed(copy.path / part)
    with pytest.raises(InputError, match=message):
        check(copy)


def test_a_changed_answer_with_a_changed_digest_does_not_keep_its_score(copy: RunFolder):
    path = copy.answer("case0001", OURS) / "diagnosis.json"
    path.write_text(json.dumps({**CONSISTENT, "verdict": "unexplained"}))
    noted = json.loads(copy.answers("case0001").read_text())
    digest = diagnosing.digest_of_folder(path.parent)
    noted["answers"][OURS]["sha256"] = digest
    copy.answers("case0001").write_text(json.dumps(noted))
    with pytest.raises(InputError, match=r"case0001\.json: the scores do not follow"):
        check(copy)


def test_a_changed_key_is_one_line_and_status_2(copy: RunFolder):
    path = copy.opened("case0001")
    content = json.loads(path.read_text())
    other = json.loads(copy.opened("case0002").read_text())
    path.write_text(json.dumps({**content, "key": other["key"]}))
    command = [sys.executable, "-m", "wipx", "task=blind_check", f"task.folder='{copy.path}'", "tracking=none"]
    out = f"hydra.run.dir='{copy.path.parent / 'check'}'"
    done = subprocess.run([*command, out], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "the seal or the key was changed" in done.stderr


def unopened(folder: RunFolder, case: str) -> str:
    """Take back the opening of a case and its answers; returns its key."""
    key = json.loads(folder.opened(case).read_text())["key"]
    folder.opened(case).unlink()
    shutil.rmtree(folder.answers(case).parent)
    return key


def test_an_interrupted_run_goes_on_with_the_same_robots(copy: RunFolder, monkeypatch: pytest.MonkeyPatch):
    published, key = copy.commitments.read_bytes(), unopened(copy, "case0002")
    kept = {"schema": 1, "seed": SEED, "given": True, "pauses": 1, "keys": {"case0002": key}}
    copy.keys.write_text(json.dumps(kept))

    def interrupted(self: Diagnosers, settings: str, arguments: list[str]) -> str:
        assert not copy.keys.exists()  # while something is diagnosed
        raise KeyboardInterrupt

    monkeypatch.setattr(Diagnosers, "_watched", interrupted)
    with pytest.raises(KeyboardInterrupt):
        TASK.run(job(copy.path))
    assert stat.S_IMODE(copy.keys.stat().st_mode) == 0o600
    assert "1 robot with hidden physics" in (copy.path / "index.html").read_text()
    with pytest.raises(InputError, match="an unfinished run of other settings"):
        replace(TASK, cases=3).run(job(copy.path))
    with pytest.raises(InputError, match="not of seed 6"):
        replace(TASK, seed=6).run(job(copy.path))

    monkeypatch.setattr(Diagnosers, "_watched", answered_nothing)
    TASK.run(job(copy.path))
    assert copy.commitments.read_bytes() == published
    assert not copy.keys.exists()
    page = (copy.path / "index.html").read_text()
    assert "2 robots with hidden physics" in page
    assert "interrupted 2 times;" in page
    check(copy)


class FreshRobotsError(Exception):
    pass


def fresh(self: BlindBenchmark, folder: RunFolder) -> None:
    raise FreshRobotsError


def test_a_run_without_its_keys_is_set_aside_with_what_is_opened(copy: RunFolder, monkeypatch: pytest.MonkeyPatch):
    unopened(copy, "case0002")
    monkeypatch.setattr(BlindBenchmark, "_drawn", fresh)
    with pytest.raises(FreshRobotsError):
        TASK.run(job(copy.path))
    (earlier,) = (copy.path / "earlier").iterdir()
    assert "1 of 2 cases are not opened" in (earlier / "index.html").read_text()
    assert [path.name for path in copy.path.iterdir()] == ["earlier"]


def test_a_finished_run_is_set_aside_for_fresh_robots(copy: RunFolder, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(BlindBenchmark, "_drawn", fresh)
    with pytest.raises(FreshRobotsError):
        TASK.run(job(copy.path))
    (earlier,) = (copy.path / "earlier").iterdir()
    check(RunFolder(earlier))


def test_an_unknown_method_is_refused_before_robots_are_drawn():
    with pytest.raises(InputError, match=r"task\.baselines: guess: .* unknown option"):
        check_methods(("guess",))


def test_a_page_that_does_not_exist_is_refused_before_robots_are_drawn(tmp_path: Path):
    with pytest.raises(InputError, match=r"there is no file nowhere\.md"):
        replace(TASK, page="nowhere.md").run(job(tmp_path / "run"))


def test_a_folder_with_other_things_in_it_is_left_alone(tmp_path: Path):
    (tmp_path / "recordings").mkdir()
    with pytest.raises(InputError, match="holds recordings but no commitments"):
        TASK.run(job(tmp_path))


def test_what_is_still_drawn_for_a_process_that_was_killed_does_not_mix_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    shown = benchmark._shown

    def beside_another(begun: list[Future[Sealed]], words: str) -> Iterator[Sealed]:
        yield from shown(begun, words)
        (own,) = (tmp_path / "run").glob(f"{benchmark.DRAWING}*")
        late = own.with_name(own.name.replace(str(os.getpid()), "1")) / "recordings" / "case0001" / "r9.csv"
        late.parent.mkdir(parents=True, exist_ok=True)
        late.write_text("t,x\n")

    monkeypatch.setattr(benchmark, "_shown", beside_another)
    monkeypatch.setattr(Diagnosers, "_watched", answered_nothing)
    TASK.run(job(tmp_path / "run"))
    check(RunFolder(tmp_path / "run"))


def test_two_processes_do_not_work_on_one_run(tmp_path: Path):
    (tmp_path / "running.pid").write_text("1")
    with pytest.raises(InputError, match="another process is at work"):
        TASK.run(job(tmp_path))


def test_no_job_of_a_sweep_answers_a_case_while_the_keys_are_on_disk(tmp_path: Path):
    RunFolder(tmp_path).paused.touch()
    with pytest.raises(InputError, match="the run is interrupted; start it again, which answers case0001 too"):
        BlindAnswer(str(tmp_path), "case0001").run(job(tmp_path / "job"))
