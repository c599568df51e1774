"""Logs whose format follows from the name and content of the file."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.importing.formats.arrays import ArrayLog
from wipx.importing.formats.can_log import CanLog
from wipx.importing.formats.lerobot import LeRobotLog
from wipx.importing.formats.mcap_log import McapLog
from wipx.importing.formats.ros1_bag import Ros1Bag
from wipx.importing.formats.ros2_bag import Ros2Bag
from wipx.importing.formats.tables import TableLog
from wipx.importing.formats.vectornav import VectorNavLog
from wipx.importing.log_format import Chunk, LogFormat, Loss, Wanted


@dataclass(frozen=True)
class RosLog(LogFormat):
    """A bag of ROS 1 or ROS 2, or an MCAP file.

    Attributes:
        definitions: Folder of .msg files (PACKAGE/msg/TYPE.msg) of types that the log does not define; null for none.
    """

    definitions: str | None = None

    def reads(self, path: Path) -> bool:
        """Whether it is one of them."""
        return any(one.reads(path) for one in self._formats())

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        expected = "expected a .bag, .mcap or .db3 file, or the folder of a ROS 2 bag"
        return _first(self._formats(), path, expected).read(path, wanted)

    def _formats(self) -> tuple[LogFormat, ...]:
        return Ros1Bag(self.definitions), McapLog(self.definitions), Ros2Bag(self.definitions)


@dataclass(frozen=True)
class AnyLog(LogFormat):
    """A log of any format, with the settings that the format has without being asked."""

    def reads(self, path: Path) -> bool:
        """Whether some format reads it."""
        return any(one.reads(path) for one in self._formats())

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        expected = (
            "expected a bag of ROS, an MCAP, CAN, VectorNav, HDF5, NPZ, CSV or Parquet file, or a LeRobot data set"
        )
        return _first(self._formats(), path, expected).read(path, wanted)

    def _formats(self) -> tuple[LogFormat, ...]:
        return RosLog(), LeRobotLog(), CanLog(), VectorNavLog(), ArrayLog(), TableLog()


def _first(formats: tuple[LogFormat, ...], path: Path, expected: str) -> LogFormat:
    for one in formats:
        if one.reads(path):
            return one
    raise InputError(f"log.path {path}: {expected}; check the path, or choose the format with import=...")
