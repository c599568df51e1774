"""What came of one group of runs: the diagnosis, predictions of all other groups, and the JSON file that keeps both."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.diagnosis import Diagnosis
from wipx.core.sizes import Size
from wipx.proof.baseline_answers import MethodAnswer, NamedEffect
from wipx.tasks.files.results import write_json

FILE = "group.json"
OURS = "wipx"


@dataclass(frozen=True)
class GroupResult:
    """One group of runs of a rig.

    Attributes:
        rig: Name of the rig.
        way: Of splitting its runs.
        group: Name of the group.
        recordings: Names of the group's recordings.
        verdict: Of the diagnosis; empty where it refused the recordings.
        answers: Of the diagnosis, under `OURS`, and of other methods, by name.
        sizes: Numbers of the effects that the diagnosis names.
        errors: Root mean square of predictions of all other groups, by model ("nominal", "identified", "authors",
            "noise floor") and column [SI]; those of the methods stand in `answers`.
        units: SI unit by column.
    """

    rig: str
    way: str
    group: str
    recordings: tuple[str, ...]
    verdict: str
    answers: Mapping[str, MethodAnswer]
    sizes: tuple[Size, ...] = ()
    errors: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def ours(self) -> MethodAnswer:
        """The answer of the diagnosis."""
        return self.answers[OURS]

    def ratio(self, method: str, model: str) -> float | None:
        """Error of a method's model over that of another one, the geometric mean over the columns; None if unknown."""
        mine, other = self.answers[method].errors, self.errors.get(model, {})
        if not mine or not other:
            return None
        return float(np.exp(np.mean([np.log(mine[column] / other[column]) for column in mine])))


def sizes_of(diagnosis: Diagnosis) -> tuple[Size, ...]:
    """The numbers of all effects of a diagnosis, with their intervals."""
    return tuple(
        Size(effect.name, p.name.rpartition(".")[2], p.value, p.low, p.high, p.unit)
        for effect in diagnosis.effects
        for p in effect.parameters
    )


def answer_of(diagnosis: Diagnosis, errors: Mapping[str, float]) -> MethodAnswer:
    """The diagnosis as an answer beside those of other methods."""
    named = tuple(NamedEffect(effect.name, tuple(effect.equivalent)) for effect in diagnosis.effects)
    return MethodAnswer(OURS, named, errors, diagnosis.seconds)


def write_group(result: GroupResult, asked: Mapping[str, Any], folder: Path) -> None:
    """Keep a result, with what was asked."""
    write_json(folder / FILE, {"schema": 1, "asked": asked, "result": asdict(result)})


def read_group(asked: Mapping[str, Any], folder: Path) -> GroupResult | None:
    """The result that a folder keeps; None where there is none, or where something else was asked."""
    path = folder / FILE
    if not path.is_file():
        return None
    content = json.loads(path.read_text(encoding="utf-8"))
    if content["asked"] != json.loads(json.dumps(asked)):
        return None
    kept = content["result"]
    answers = {
        name: MethodAnswer(**{**answer, "effects": tuple(_effect(effect) for effect in answer["effects"])})
        for name, answer in kept["answers"].items()
    }
    sizes = tuple(_size(size) for size in kept["sizes"])
    return GroupResult(**{**kept, "recordings": tuple(kept["recordings"]), "answers": answers, "sizes": sizes})


def _size(kept: Mapping[str, Any]) -> Size:
    value, low, high = (float("nan") if kept[key] is None else kept[key] for key in ("value", "low", "high"))
    return Size(kept["effect"], kept["symbol"], value, low, high, kept["unit"])


def _effect(kept: Mapping[str, Any]) -> NamedEffect:
    return NamedEffect(kept["name"], tuple(kept["equivalent"]))
