"""Where recordings come from: a folder, with settings that say which part of it to use.

The settings are plain values, so that a YAML file of `conf/recordings` can hold them.
"""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.plant import Plant
from wipx.core.recording import Recording, RecordingSplit
from wipx.recordings.held_out import FEWEST_ROWS, split_recordings
from wipx.recordings.plausible import check_recording
from wipx.recordings.robot_file import RobotDescription, read_robot, robot_from_mapping
from wipx.recordings.signals import Signal, plain_signal, recorded_columns, required_columns
from wipx.recordings.strict_yaml import finite_number, load_mapping
from wipx.recordings.tables import Table, check_increasing, open_table

ROBOT_FILE = "robot.yaml"
GENERAL_PATTERNS = ("*.csv", "*.parquet")  # either may match nothing


@dataclass(frozen=True)
class RecordingSource:
    """A set of recordings and the robot that they show.

    Attributes:
        path: Folder of the recordings, or several folders of one robot.
        title: Of reports; the folder's name where there is none.
        robot: Content of robot.yaml; None where the folder holds that file.
        files: Patterns of the recordings' file names.
        spans: Part of a recording to keep, [from, to] in seconds of its own time, by pattern of file
            names; null leaves an end open.
        where: Value by column of the log; the leading rows with these values are kept.
        held_out: "auto", the last share of each recording's time, or patterns of file names.
        origin: Where the recordings can be had; named when they are missing.
    """

    path: str | list[str] | None = None
    title: str | None = None
    robot: dict[str, Any] | None = None
    files: list[str] = field(default_factory=lambda: list(GENERAL_PATTERNS))
    spans: dict[str, list[float | None]] = field(default_factory=dict)
    where: dict[str, float] = field(default_factory=dict)
    held_out: str | float | list[str] = "auto"
    origin: str = ""

    @property
    def name(self) -> str:
        """The title, or the folder's name."""
        return self.title or " and ".join(part._folder().resolve().name for part in self._parts())

    @property
    def place(self) -> str:
        """Where the recordings are, for messages."""
        return ", ".join(self.path) if isinstance(self.path, list) else str(self.path)

    def describe(self) -> RobotDescription:
        """The robot, as its owner knows it.

        Raises:
            InputError: the description is missing or at fault.
        """
        if self.robot is not None:
            return robot_from_mapping(self.robot, self._where())
        if isinstance(self.path, list):
            return _one_robot(self._parts())
        path = self._folder() / ROBOT_FILE
        if not path.is_file():
            raise InputError(f"{path} is missing; describe the robot there: plant and parameters{self._hint()}")
        return read_robot(path)

    def load(self) -> tuple[Recording, ...]:
        """All recordings of one robot in SI, by file name; uneven time steps and missing rows stay as logged.

        Raises:
            InputError: the folder, a file, a column or a row is missing or at fault, or the robot carried a
                known load in some of the recordings, so that they are not of one robot.
        """
        recordings = self.load_all()
        if any(load is not None for load in self.loads(recordings)):
            raise InputError(
                f"{self._where()} names loads, so its recordings show different robots; use task=adapt, or "
                "choose recordings without a load with recordings.files=[...]"
            )
        return recordings

    def load_all(self) -> tuple[Recording, ...]:
        """All recordings as `load` has them, of the robot with any of its known loads too.

        Raises:
            InputError: the folder, a file, a column or a row is missing or at fault.
        """
        if isinstance(self.path, list):
            return self._joined()
        robot = self.describe()
        paths = self._paths(self.files)
        for pattern in self.spans:
            if not any(fnmatch(name, pattern) for name in paths):
                raise InputError(f"recordings.spans: {pattern} matches none of {', '.join(paths)}; correct the pattern")
        recordings = tuple(self._recording(name, path, robot) for name, path in paths.items())
        if robot.model.plant.tree is not None:
            for recording in recordings:
                for warning in check_recording(recording, robot.model.plant, robot.signals):
                    print(f"warning: {warning}", file=sys.stderr)
        return recordings

    def loads(self, recordings: tuple[Recording, ...]) -> tuple[Load | None, ...]:
        """What is known to have been on the body in each of the recordings; None where it was nothing.

        Raises:
            InputError: two loads claim one recording, or the pattern of a load matches no file.
        """
        robot = self.describe()
        if isinstance(self.path, list) and robot.loads:
            raise InputError(f"recordings.path: {self.place}: folders with loads cannot be joined; choose one of them")
        if robot.loads:
            # Of all files, not the chosen ones: who chooses some need not correct robot.yaml.
            everything = self._paths((*self.files, *GENERAL_PATTERNS))
            for name, known in robot.loads.items():
                if not any(fnmatch(file, known.recordings) for file in everything):
                    raise InputError(
                        f"{self._where()}: loads: {name}: {known.recordings} matches none of the recordings; "
                        "correct the pattern"
                    )
        return tuple(robot.load_of(recording.name) for recording in recordings)

    def split(self, recordings: tuple[Recording, ...]) -> RecordingSplit:
        """Divide loaded recordings by the setting `held_out`.

        Raises:
            InputError: the setting is at fault or leaves too little on one side.
        """
        return split_recordings(recordings, self.held_out)

    def _parts(self) -> tuple["RecordingSource", ...]:
        """One source for each folder."""
        if not isinstance(self.path, list):
            return (self,)
        if not self.path:
            raise InputError("recordings.path is empty; give a folder, or several as [FOLDER,FOLDER]")
        return tuple(replace(self, path=path) for path in self.path)

    def _joined(self) -> tuple[Recording, ...]:
        """Recordings of all folders; each is named with its folder, from the one on that holds all of them."""
        self.describe()
        parts = self._parts()
        folders = [str(part._folder().resolve()) for part in parts]
        if len(set(folders)) < len(folders):
            raise InputError(f"recordings.path: {self.place}: a folder is listed twice; list it once")
        above = os.path.commonpath(folders)
        return tuple(
            replace(recording, name=Path(os.path.relpath(folder, above), recording.name).as_posix())
            for folder, part in zip(folders, parts, strict=True)
            for recording in part.load_all()
        )

    def _where(self) -> str:
        """Where the robot is described."""
        return str(Path(self.place) / ROBOT_FILE) if self.robot is None else "recordings.robot"

    def _hint(self) -> str:
        return f" (the recordings come from {self.origin})" if self.origin else ""

    def _folder(self) -> Path:
        """The one folder."""
        if not isinstance(self.path, str):
            needed = f"the folder with {ROBOT_FILE} and the recordings"
            raise InputError(f"recordings.path is needed: {needed}{self._hint()}")
        folder = Path(self.path).expanduser()
        if not folder.is_dir():
            found = "is no folder" if folder.exists() else "does not exist"
            raise InputError(f"recordings.path {folder} {found}; expected a folder of recordings{self._hint()}")
        return folder

    def _paths(self, patterns: Sequence[str]) -> dict[str, Path]:
        """Files by their name within the folder, sorted."""
        folder = self._folder()
        found = set()
        for pattern in patterns:
            try:
                matching = [path for path in folder.glob(pattern) if path.is_file()]
            except (ValueError, NotImplementedError) as error:
                raise InputError(f"recordings.files: {pattern!r} is no pattern of file names; try *.csv") from error
            if not matching and pattern not in GENERAL_PATTERNS:
                raise InputError(f"{folder}: no file matches {pattern} of recordings.files{self._hint()}")
            found.update(matching)
        if not found:
            raise InputError(f"{folder}: no recordings, expected files {' or '.join(patterns)}{self._hint()}")
        return {path.relative_to(folder).as_posix(): path for path in sorted(found)}

    def _recording(self, name: str, path: Path, robot: RobotDescription) -> Recording:
        table = open_table(path)
        kept = _leading_rows(table, self.where)
        signals = _signals_of(table, robot)
        t = _read(signals["t"], table, 0, kept)
        check_increasing(t, table)
        begin, end = self._span(name)
        first, last = (int(row) for row in np.searchsorted(t, (begin, end), side="left"))
        if last - first < FEWEST_ROWS:
            chosen = " that recordings.spans and recordings.where keep" if last - first < table.rows else ""
            raise InputError(f"{path}: {last - first} rows{chosen}, expected {FEWEST_ROWS} or more; leave the file out")
        columns = {column: _read(signal, table, first, last) for column, signal in signals.items() if column != "t"}
        kept_t = t[first:last]
        return Recording(name, {"t": kept_t, **columns}, str(path), _periods(kept_t, robot))

    def _span(self, name: str) -> tuple[float, float]:
        for pattern, span in self.spans.items():
            if not fnmatch(name, pattern):
                continue
            if not _is_span(span):
                raise InputError(f"recordings.spans: {pattern} is {span!r}, expected [from, to] in s, from < to")
            begin, end = span
            return float("-inf") if begin is None else begin, float("inf") if end is None else end
        return float("-inf"), float("inf")


def _one_robot(parts: Sequence[RecordingSource]) -> RobotDescription:
    """The description that all folders share; each reads its columns by its own signals.

    Raises:
        InputError: a folder describes another robot.
    """
    described = [(part.describe(), _written(Path(part.place).expanduser())) for part in parts]
    (robot, content), *others = described
    for part, (_, other) in zip(parts[1:], others, strict=True):
        for key in {**content, **other}:
            if content.get(key) != other.get(key):
                raise InputError(
                    f"recordings.path: {parts[0].place} and {part.place} are not of one robot: {key} differs in their "
                    f"{ROBOT_FILE}; diagnose them apart, or make the files agree"
                )
    return robot


def _written(folder: Path) -> dict[str, object]:
    """What a folder's robot.yaml says of the robot, with the content of its model file in the place of its name."""
    content = {key: value for key, value in load_mapping(folder / ROBOT_FILE).items() if key != "signals"}
    if "model" in content:
        content["model"] = (folder / str(content["model"])).read_bytes()
    return content


def _periods(t: np.ndarray, robot: RobotDescription) -> int:
    """Commands of the controller per row; 1 where its rate is not known."""
    if robot.controller is None:
        return 1
    return max(1, round(float(np.median(np.diff(t))) * robot.controller.rate))


def _is_span(span: object) -> bool:
    if not isinstance(span, list | tuple) or len(span) != 2:
        return False
    ends = [end for end in span if end is not None]
    if any(finite_number(end) is None for end in ends):
        return False
    return len(ends) < 2 or ends[0] < ends[1]


def _signals_of(table: Table, robot: RobotDescription) -> dict[str, Signal]:
    """The signals of every column that is required, mapped by the owner or in the file."""
    plant = robot.model.plant
    required = required_columns(plant)
    chosen = {}
    for column in recorded_columns(plant):
        if column in robot.signals:
            chosen[column] = robot.signals[column]
        elif column in required or column in table.names:
            chosen[column] = plain_signal(column, plant)
    for column, signal in chosen.items():
        _check_present(column, signal, table, plant)
    return chosen


def _check_present(column: str, signal: Signal, table: Table, plant: Plant) -> None:
    for needed in signal.needs:
        if needed in table.names:
            continue
        have = ", ".join(table.names)
        if needed == column:
            raise InputError(
                f"{table.path}: column {needed} [{plant.unit_of(column)}] is missing; rename one of {have}, "
                f"or name its column under signals in {ROBOT_FILE}{_or_locked(column, plant)}"
            )
        raise InputError(f"{table.path}: column {needed} of signals.{column} is missing; the file has {have}")


def _or_locked(column: str, plant: Plant) -> str:
    if plant.tree is None or column not in plant.coordinates:
        return ""
    return f"; a joint that does not move is listed as locked: {{{column}: 0.0}}"


def _read(signal: Signal, table: Table, first: int, last: int) -> np.ndarray:
    logged = {name: table.column(name, first, last) for name in signal.needs}
    return signal.values(logged, last - first)


def _leading_rows(table: Table, where: Mapping[str, float]) -> int:
    """Number of rows before the first in which a column of the log has another value."""
    kept = table.rows
    for column, value in where.items():
        other = np.flatnonzero(table.column(column) != value)
        kept = min(kept, int(other[0])) if len(other) else kept
    return kept
