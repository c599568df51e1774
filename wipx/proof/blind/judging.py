"""Third process of a blind run: opens seals of answered cases, checks every digest, and scores."""

import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.results import FitErrors
from wipx.proof.blind.diagnosing import Answer, read_answers
from wipx.proof.blind.reference import best_fit
from wipx.proof.blind_robots.dirty_score import DirtyScore
from wipx.proof.blind_robots.folder import RunFolder, read_json
from wipx.proof.blind_robots.score import CaseScore, ParameterScore, UnseenErrors, failed, score
from wipx.proof.blind_robots.seal import Commitment, digest_of_folder, unseal
from wipx.proof.blind_robots.tree_score import TreeScore
from wipx.proof.blind_robots.write import write_files
from wipx.recordings.model_file import read_model
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator
from wipx.tasks.baseline import NETWORK
from wipx.tasks.files.results import write_json
from wipx.tasks.predict import Predict

SIMULATOR = AnalyticSimulator(threads=1)


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
        unseen = Unseen(Path(private), content, folder.recordings(case))
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
        floor: Errors that the true model leaves, where the vocabulary has it, and never less than the sensors' noise
            with what it does to the state from which a prediction starts, by signal [m, rad].
        reference: Errors of the true effects, fitted to the visible recordings of a dirty robot; None for an exact one.
    """

    def __init__(self, private: Path, content: Mapping[str, Any], visible: Path) -> None:
        write_files(private / "recordings", content["unseen"])
        source = RecordingSource(path=str(private / "recordings"))
        self._nominal, self._recordings = source.describe().model, source.load()
        truth = content["truth"]
        hidden = {effect["name"]: effect["parameters"] for effect in truth["effects"]}
        true = self._predicted(self._nominal.with_values(truth["true_parameters"]).with_effects(hidden))
        floor, best = ({}, {}) if true is None else (true.noise_floor, true.completed)
        self.floor = {
            name: float(np.nanmax([noise, floor.get(name, 0.0), 0.0 if truth["outside"] else best.get(name, 0.0)]))
            for name, noise in truth["noise"].items()
        }
        self.reference = None
        if truth["dirt"] is not None:
            fitted = self._predicted(
                best_fit(self._nominal, hidden, RecordingSource(path=str(visible)).load(), SIMULATOR)
            )
            self.reference = None if fitted is None else fitted.completed

    def errors(self, answer: Path) -> UnseenErrors | None:
        """Errors of the nominal model and of a method's; None where the recordings cannot be predicted."""
        network = answer / NETWORK
        try:
            model = read_model(answer / "model.yaml")
        except InputError:
            return None
        found = self._predicted(model, str(network) if network.is_file() else None)
        if found is None or not np.isfinite([*found.completed.values(), *found.nominal.values()]).all():
            return None
        return UnseenErrors(found.nominal, found.completed, self.floor, self.reference)

    def _predicted(self, model: Model, residual: str | None = None) -> FitErrors | None:
        """What `task=predict` has in metrics.json; None where the prediction fails."""
        try:
            return Predict(residual=residual).compared(self._nominal, model, self._recordings, SIMULATOR)[0]
        except (InputError, ArithmeticError, np.linalg.LinAlgError):
            return None


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
    parameters = tuple(ParameterScore(**one) for one in entry["parameters"])
    dirty = None if entry.get("dirty") is None else DirtyScore(**entry["dirty"])
    tree = None if entry.get("tree") is None else TreeScore(**entry["tree"])
    return CaseScore(**{**entry, **names, "parameters": parameters, "dirty": dirty, "tree": tree})
