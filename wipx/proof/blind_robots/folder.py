"""The folder of a run: what is where, and who may read it.

commitments.json     published before the first diagnosis; everybody
recordings/CASE/     robot.yaml and the visible recordings; the diagnosis, of its own case alone
sealed/CASE.seal     truth, unseen recordings and seed, encrypted; nobody without the case's key
answers/CASE/        one folder for each method, the files that it opened, and digests of the answers
opened/CASE.json     key and scores, written after the digests of the answers
keys.json            keys of the cases that are not opened yet; only while the run is interrupted
paused               while it is interrupted, no job of a sweep answers a case
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError


@dataclass(frozen=True)
class RunFolder:
    """Where the parts of a run are.

    Attributes:
        path: The folder.
    """

    path: Path

    @property
    def commitments(self) -> Path:
        """The published digests."""
        return self.path / "commitments.json"

    @property
    def keys(self) -> Path:
        """Keys of an interrupted run."""
        return self.path / "keys.json"

    @property
    def paused(self) -> Path:
        """There while no job may begin to answer a case."""
        return self.path / "paused"

    def recordings(self, case: str) -> Path:
        """Folder of a case's visible recordings."""
        return self.path / "recordings" / case

    def seal(self, case: str) -> Path:
        """A case's encrypted answer."""
        return self.path / "sealed" / f"{case}.seal"

    def answers(self, case: str) -> Path:
        """Digests of what was answered."""
        return self.path / "answers" / case / "answers.json"

    def answer(self, case: str, method: str) -> Path:
        """Folder of a method's answer."""
        return self.path / "answers" / case / method

    def witnessed(self, case: str, method: str) -> Path:
        """List of the files that a method opened."""
        return self.path / "answers" / case / f"{method}.opened.txt"

    def opened(self, case: str) -> Path:
        """Key and scores of a case."""
        return self.path / "opened" / f"{case}.json"


def read_json(path: Path) -> dict[str, Any]:
    """Content of a JSON file.

    Raises:
        InputError: the file is missing or no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); restore it, or start another run") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: no JSON ({error}); restore it, or start another run") from error
