"""Folders of recordings, written by the tests."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from moving_arm import MovingArm, made_arm

PENDULUM = """
plant: pendulum
parameters: {body_mass: 0.8, com_height: 0.4, body_inertia: 0.03}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the robot.yaml of a pendulum and no recording yet."""
    (tmp_path / "robot.yaml").write_text(PENDULUM)
    return tmp_path


@pytest.fixture
def swing() -> Callable[[int], dict[str, np.ndarray]]:
    """Columns t, theta and u of a pendulum's recording with that many rows."""

    def columns(rows: int) -> dict[str, np.ndarray]:
        t = np.arange(rows) * 0.01
        return {"t": t, "theta": 0.1 * np.sin(3.0 * t), "u": 0.5 * np.cos(2.0 * t)}

    return columns


@pytest.fixture
def write_csv() -> Callable[[Path, dict[str, np.ndarray]], Path]:
    """Writes columns as CSV with all digits."""

    def write(path: Path, columns: dict[str, np.ndarray]) -> Path:
        lines = [",".join(columns)]
        lines += [",".join(repr(float(cell)) for cell in row) for row in zip(*columns.values(), strict=True)]
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


@pytest.fixture(scope="session")
def moving_arm(tmp_path_factory: pytest.TempPathFactory) -> MovingArm:
    """A motion of an arm with the forces that it needs."""
    return made_arm(tmp_path_factory.mktemp("model"))
