"""Third process of a concealed run: opens seals of answered cases, checks every digest, and scores."""

import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from wipx.concealed.folder import RunFolder, read_json
from wipx.concealed.score import CaseScore, ParameterScore, UnseenErrors, failed, score
from wipx.concealed.seal import Commitment, digest_of_folder, unseal
from wipx.concealed.write import write_files
from wipx.core.errors import InputError
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.concealed_diagnose import ONE_THREAD, Answer, read_answers
from wipx.tasks.results import write_json
from wipx.tasks.rival import NETWORK


@dataclass(frozen=True)
class Opened:
    """An opened case.

    Attributes:
        case: Its name.
        key: Of its seal, public from now on.
        scores: Of each method.
        errors: Of each method on the unseen recordings; None where they could not be predicted.
    """

    case: str
    key: str
    scores: Mapping[str, CaseScore]
    errors: Mapping[str, UnseenErrors | None]


def judge(path: Path, case: str, key: str) -> Opened:
    """Open a case whose answers are noted, score them, and write key and scores.

    Args:
        path: Folder of the run.
        case: Name of the case.
        key: Of its seal.

    Raises:
        InputError: the seal, the key, the recordings or an answer are not what they were; see `verified`.
    """
    folder = RunFolder(path)
    content = verified(folder, read_commitments(folder)[case], key)
    answers = read_answers(folder.answers(case))
    with tempfile.TemporaryDirectory(prefix="unseen-") as private:  # readable by this user alone
        unseen = Unseen(Path(private), content)
        errors = {
            method: None if answer.failure else unseen.errors(folder.answer(case, method))
            for method, answer in answers.items()
        }
    opened = Opened(case, key, scores_of(folder, case, content, answers, errors), errors)
    folder.opened(case).parent.mkdir(parents=True, exist_ok=True)
    draft = folder.opened(case).with_suffix(".part")
    write_json(draft, {"schema": 1, **asdict(opened)})
    draft.replace(folder.opened(case))
    return opened


def verified(folder: RunFolder, commitment: Commitment, key: str) -> dict[str, Any]:
    """The content of a case's seal, after all that was written down before it is opened has been compared.

    Raises:
        InputError: recordings, an answer, the seal or the key were changed.
    """
    case = commitment.case
    recordings = folder.recordings(case)
    if digest_of_folder(recordings) != commitment.recordings:
        raise InputError(f"{recordings}: not the recordings that commitments.json commits to; restore the folder")
    for method, answer in read_answers(folder.answers(case)).items():
        place = folder.answer(case, method)
        if digest_of_folder(place) != answer.sha256:
            raise InputError(f"{place}: changed after it was answered, see {folder.answers(case)}; restore the folder")
    return unseal(folder.seal(case), key, commitment)


def scores_of(
    folder: RunFolder,
    case: str,
    content: Mapping[str, Any],
    answers: Mapping[str, Answer],
    errors: Mapping[str, UnseenErrors | None],
) -> dict[str, CaseScore]:
    """Scores of all methods for an opened case."""
    scores = {}
    for method, answer in answers.items():
        if answer.failure:
            scores[method] = failed(case, content["truth"], answer.seconds, answer.failure)
        else:
            diagnosis = read_json(folder.answer(case, method) / "diagnosis.json")
            scores[method] = score(case, content["truth"], diagnosis, answer.seconds, errors[method])
    return scores


class Unseen:
    """The unseen recordings of an opened case, and how well they can be predicted.

    Attributes:
        private: Folder for them and for the predictions.
        floor: Errors that the true model leaves, where the vocabulary has it, and never less than the sensors' noise
            with what it does to the state from which a prediction starts, by signal [m, rad].
    """

    def __init__(self, private: Path, content: Mapping[str, Any]) -> None:
        self.private = private
        write_files(private / "recordings", content["unseen"])
        truth = content["truth"]
        nominal = RecordingSource(path=str(private / "recordings")).describe().model
        hidden = {effect["name"]: effect["parameters"] for effect in truth["effects"]}
        write_model(nominal.with_values(truth["true_parameters"]).with_effects(hidden), private / "model.yaml")
        predicted = self._predicted(private) or {"rms": {}, "noise_floor": {}}
        best = {} if truth["outside"] else predicted["rms"]
        self.floor = {
            name: max(noise, predicted["noise_floor"].get(name) or 0.0, best.get(name) or 0.0)
            for name, noise in truth["noise"].items()
        }

    def errors(self, answer: Path) -> UnseenErrors | None:
        """Errors of the nominal model and of a method's; None where the recordings cannot be predicted."""
        metrics = self._predicted(answer)
        if metrics is None or None in (*metrics["rms"].values(), *metrics["rms_nominal"].values()):
            return None
        return UnseenErrors(metrics["rms_nominal"], metrics["rms"], self.floor)

    def _predicted(self, answer: Path) -> dict[str, Any] | None:
        """Content of metrics.json for the model.yaml in a folder; None where the prediction fails."""
        out = self.private / "prediction" / answer.name
        command = [sys.executable, "-m", "wipx", "task=predict", "tracking=none", "sim.threads=1"]
        command += [f"recordings.path='{self.private / 'recordings'}'", f"hydra.run.dir='{out}'"]
        command += [f"model.path='{answer.resolve() / 'model.yaml'}'"]
        if (answer / NETWORK).is_file():
            command += [f"task.residual='{answer.resolve() / NETWORK}'"]
        done = subprocess.run(command, capture_output=True, check=False, env=ONE_THREAD)
        return read_json(out / "metrics.json") if done.returncode == 0 else None


def read_commitments(folder: RunFolder) -> dict[str, Commitment]:
    """What was published, by case.

    Raises:
        InputError: the file is missing or damaged.
    """
    content = read_json(folder.commitments)
    try:
        return {entry["case"]: Commitment(**entry) for entry in content["cases"]}
    except (KeyError, TypeError) as error:
        raise InputError(f"{folder.commitments}: no list of commitments ({error}); restore it") from error


def read_opened(path: Path) -> Opened:
    """An opened case from its file.

    Raises:
        InputError: the file is missing or damaged.
    """
    content = read_json(path)
    try:
        return Opened(
            content["case"],
            content["key"],
            {method: _score_from(entry) for method, entry in content["scores"].items()},
            {method: None if entry is None else UnseenErrors(**entry) for method, entry in content["errors"].items()},
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no opened case ({error}); restore it, or start another run") from error


def _score_from(entry: dict[str, Any]) -> CaseScore:
    names = {name: tuple(entry[name]) for name in ("truth", "answer")}
    return CaseScore(**{**entry, **names, "parameters": tuple(ParameterScore(**one) for one in entry["parameters"])})
