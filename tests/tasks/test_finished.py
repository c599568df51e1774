"""A job that was done is not done again; one that was done otherwise, or failed, is named."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from wipx.core.errors import InputError
from wipx.tasks.files.finished import ERROR, finish, finished, finished_jobs
from wipx.tasks.shared.job import Job

SETTINGS: dict[str, Any] = {"name": "a", "seed": 1, "optimizer": {"particles": 50, "bounds": [0, 1]}, "tracking": None}


def job(out: Path, **changes: Any) -> Job:
    out.mkdir(exist_ok=True)
    return Job(out, 1, (), {}, {}, None, lambda group: None, lambda node, name: None, {**SETTINGS, **changes})


def done(out: Path) -> Path:
    finish(job(out), out, {"loss": 0.5})
    return out


def test_a_result_of_the_same_settings_is_found_again(tmp_path: Path):
    assert finished(job(tmp_path / "a")) is None
    done(tmp_path / "a")
    assert finished(job(tmp_path / "a")) == {"loss": 0.5}


def test_settings_that_change_no_result_may_differ(tmp_path: Path):
    done(tmp_path / "a")
    assert finished(job(tmp_path / "a", name="b", tracking={"folder": "elsewhere"})) == {"loss": 0.5}


def test_a_result_of_other_settings_is_refused_with_the_keys_that_changed(tmp_path: Path):
    done(tmp_path / "a")
    with pytest.raises(InputError, match=r"optimizer\.particles \(50 before, 60 now\)"):
        finished(job(tmp_path / "a", optimizer={"particles": 60, "bounds": [0, 1]}))


def test_a_sweep_with_holes_is_refused_with_the_first_reason(tmp_path: Path):
    done(tmp_path / "a")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / ERROR).write_text("optimizer: no such thing\n\ntrace")
    (tmp_path / "c").mkdir()
    with pytest.raises(InputError, match=r"2 of 3 jobs .*1 not finished, 1 failed.*first b: optimizer: no"):
        finished_jobs(tmp_path)
    done(tmp_path / "b")
    done(tmp_path / "c")
    assert [path.name for path in finished_jobs(tmp_path)] == ["a", "b", "c"]
    assert not (tmp_path / "b" / ERROR).exists()


def test_a_folder_without_jobs_and_a_damaged_result_are_named(tmp_path: Path):
    with pytest.raises(InputError, match="no jobs here"):
        finished_jobs(tmp_path / "nothing")
    done(tmp_path / "a")
    (tmp_path / "a" / "result.json").write_text("{")
    with pytest.raises(InputError, match="not the result of a job"):
        finished(replace(job(tmp_path / "a")))
