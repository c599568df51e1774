"""Jobs that need not be done twice: a result beside the settings that it was made with."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.tasks.files.results import RESULT, flat, write_json
from wipx.tasks.shared.job import Job

SETTINGS = "config.yaml"  # stands beside the results of every task that has succeeded
ERROR = "error.txt"
WITHOUT_EFFECT = ("name", "label", "tracking", "log", "write")  # settings that change no result


def finished(job: Job) -> Mapping[str, Any] | None:
    """The result that the job's folder holds already; None where there is none.

    Raises:
        InputError: it was made with other settings.
    """
    if not (job.out / RESULT).is_file():
        return None
    content = read_result(job.out)
    before, now = content["settings"], _settings(job)
    changed = sorted(key for key in {*before, *now} if before.get(key) != now.get(key))
    if changed:
        named = ", ".join(f"{key} ({before.get(key)} before, {now.get(key)} now)" for key in changed[:3])
        more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
        raise InputError(
            f"{job.out / RESULT}: made with other settings: {named}{more}; remove the folder or give another name=..."
        )
    return content["result"]


def finish(job: Job, folder: Path, result: Mapping[str, object]) -> None:
    """Write the job's result, with its settings, to a folder of unfinished results."""
    write_json(folder / RESULT, {"schema": 1, "settings": _settings(job), "result": result})
    (job.out / ERROR).unlink(missing_ok=True)


def read_result(folder: Path) -> Mapping[str, Any]:
    """The result of a job's folder, with its settings.

    Raises:
        InputError: there is none, or it cannot be read.
    """
    path = folder / RESULT
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return {"settings": dict(content["settings"]), "result": content["result"]}
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; run the job first") from error
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: not the result of a job ({error}); remove the folder and run the job again"
        ) from error


def finished_jobs(sweep: Path) -> list[Path]:
    """Folders of a sweep's jobs, all of which have finished.

    Raises:
        InputError: the sweep does not exist, has no job, or jobs that failed or were not finished.
    """
    folders = sorted(path for path in sweep.iterdir() if path.is_dir()) if sweep.is_dir() else []
    jobs = [path for path in folders if not path.name.startswith(".") and path.name != "table"]
    if not jobs:
        raise InputError(f"{sweep}: no jobs here; run the sweep first")
    open_ones = [path for path in jobs if not (path / RESULT).is_file()]
    if open_ones:
        failed = [path.name for path in open_ones if (path / ERROR).is_file()]
        states = f"{len(open_ones) - len(failed)} not finished, {len(failed)} failed"
        first = open_ones[0]
        why = (first / ERROR).read_text(encoding="utf-8").splitlines()[0] if (first / ERROR).is_file() else "no result"
        raise InputError(
            f"{sweep}: {len(open_ones)} of {len(jobs)} jobs have no result ({states}), first {first.name}: {why}; "
            "run the sweep again, which does the missing ones only"
        )
    return jobs


def _settings(job: Job) -> dict[str, object]:
    kept = {key: value for key, value in job.settings.items() if key not in WITHOUT_EFFECT}
    return json.loads(json.dumps(flat(kept)))
