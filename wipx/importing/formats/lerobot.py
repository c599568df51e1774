"""LeRobot data sets, versions 2 and 3: Parquet files with `observation.state`, `action` and the number of an episode.

Version 2 has one file for each episode, version 3 many episodes in a file; rows name their episode in both. Videos are
not read. Source: huggingface/lerobot, `lerobot/datasets` (docs: LeRobotDataset v3.0).
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.importing.formats.columns import columns_of_batch
from wipx.importing.log_format import CHUNK_ROWS, Chunk, LogFormat, Loss, Wanted, nanoseconds, unstamped

STREAM = "dataset"
INFO = Path("meta", "info.json")
TICKS = 4095  # of a Feetech servo in one turn, as LeRobot counts them
GRIPPER = "gripper"  # from 0 to 100


@dataclass(frozen=True)
class LeRobotLog(LogFormat):
    """A folder with `meta/info.json` and `data/`; its one stream is "dataset".

    Attributes:
        episodes: Numbers of the episodes to read; null for all of them.
        calibration: The arm's calibration file, where values are shares of the joints' ranges (-100 to 100, gripper 0
            to 100): they become degrees. Null where they are degrees already.
    """

    episodes: list[int] | None = None
    calibration: str | None = None

    def reads(self, path: Path) -> bool:
        """Whether the folder has `meta/info.json`."""
        return (path / INFO).is_file()

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        info = _info(path)
        files = sorted((path / "data").rglob("*.parquet"))
        if not files:
            raise InputError(f"{path / 'data'}: no Parquet files; download the data set's files, not only its pointers")
        features = info.get("features")
        names = {name: _names(feature) for name, feature in (features if isinstance(features, dict) else {}).items()}
        degrees = {} if self.calibration is None else _degrees(Path(self.calibration))
        rows: dict[int, int] = {}
        for number, file in enumerate(files):
            for item in self._file(file, names, degrees, number / len(files)):
                if isinstance(item, Chunk):
                    rows[int(item.episode)] = rows.get(int(item.episode), 0) + item.rows
                yield item
        yield from self._missing(path, info, rows)

    def _file(
        self, file: Path, names: Mapping[str, Sequence[str]], degrees: Mapping[str, float], done: float
    ) -> Iterator[Chunk | Loss]:
        import pyarrow as pa
        from pyarrow import parquet

        try:
            table = parquet.ParquetFile(file)
            for batch in table.iter_batches(batch_size=CHUNK_ROWS):
                columns = columns_of_batch(batch, names)
                scaled = {name: values * _factor(name, degrees) for name, values in columns.items()}
                yield from self._batch(file, scaled, done)
        except (pa.ArrowException, OSError, ValueError) as error:
            yield Loss(str(file), f"the file is damaged ({str(error).splitlines()[0][:120]}); the rest is not read")

    def _batch(self, file: Path, columns: Mapping[str, np.ndarray], done: float) -> Iterator[Chunk]:
        for needed in ("timestamp", "episode_index"):
            if needed not in columns:
                raise InputError(f"{file}: no column {needed}; expected a data set of LeRobot, version 2 or 3")
        numbers = columns["episode_index"]
        known = np.isfinite(numbers)
        for episode in np.unique(numbers[known]).astype(int):
            if self.episodes is not None and episode not in self.episodes:
                continue
            of_it = numbers == episode
            header = nanoseconds(columns["timestamp"][of_it])
            fields = {name: values[of_it] for name, values in columns.items()}
            yield Chunk(
                STREAM, fields, header, unstamped(len(header)), "LeRobot frames", episode=str(episode), done=done
            )

    def _missing(self, path: Path, info: Mapping[str, Any], rows: Mapping[int, int]) -> Iterator[Loss]:
        asked = self.episodes
        if asked is None:
            total = info.get("total_episodes")
            asked = list(range(total)) if isinstance(total, int) else []
        empty = [episode for episode in asked if episode not in rows]
        if empty:
            have = f"{min(rows)} to {max(rows)}" if rows else "none"
            raise InputError(
                f"{path}: episode {empty[0]} has no rows (episodes with rows: {have}); "
                "leave it out with log.format.episodes=[...]"
            )
        frames = info.get("total_frames")
        if self.episodes is None and isinstance(frames, int) and sum(rows.values()) < frames:
            yield Loss(str(path), "frames that meta/info.json counts are missing", frames - sum(rows.values()))


def _info(path: Path) -> Mapping[str, Any]:
    try:
        info = json.loads((path / INFO).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path / INFO}: cannot be read ({error}); expected a data set of LeRobot") from error
    version = str(info.get("codebase_version", "")) if isinstance(info, dict) else ""
    if not version.startswith(("v2", "v3")):
        raise InputError(f"{path / INFO}: codebase_version is {version!r}, expected v2 or v3; convert the data set")
    return info


def _degrees(path: Path) -> dict[str, float]:
    """Degrees per unit of a normalised position, by joint.

    Raises:
        InputError: the file is no calibration.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        ranges = {joint: float(motor["range_max"]) - float(motor["range_min"]) for joint, motor in content.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        expected = "expected a motor's range_min and range_max for each joint"
        raise InputError(f"log.format.calibration {path}: cannot be read ({error}); {expected}") from error
    return {joint: size / (100.0 if joint == GRIPPER else 200.0) * 360.0 / TICKS for joint, size in ranges.items()}


def _factor(column: str, degrees: Mapping[str, float]) -> float:
    for joint, factor in degrees.items():
        if column.removesuffix(".pos").endswith(f".{joint}") and column.startswith(("action", "observation.state")):
            return factor
    return 1.0


def _names(feature: object) -> Sequence[str]:
    """Names of a vector's elements: a list, or {"motors": [...]} in older data sets."""
    names = feature.get("names") if isinstance(feature, Mapping) else None
    if isinstance(names, Mapping):
        names = next(iter(names.values()), None)
    return [str(name) for name in names] if isinstance(names, list) else []
