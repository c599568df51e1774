"""Imports point one way, and heavy packages stay in their rooms."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "wipx"
LAYERS = (
    {"core"},
    {"effects"},
    {"sim"},
    {"control", "identify", "recordings", "report", "tracking"},
    {"export", "hardware", "learn"},
    {"baselines", "diagnosis", "importing"},
    {"library"},
    {"tasks"},
    {"proof"},
    {"config", "renamed"},
    {"sweep"},
    {"app"},
    {"__main__"},
)
DIAGNOSIS = (
    {"rules"},
    {"likelihood", "rules_page"},
    {"candidates", "residuals", "next_experiment"},
    {"selection"},
    {"decision"},
    {"answer"},
    {"pipeline"},
)
RANK = {room: rank for rank, layer in enumerate(LAYERS) for room in layer}
RANK_IN_DIAGNOSIS = {room: rank for rank, layer in enumerate(DIAGNOSIS) for room in layer}
ALLOWED_IN = {
    "mlflow": {"tracking"},
    "hydra": {"config", "sweep", "app", "__main__"},
    "omegaconf": {"config", "sweep", "app", "__main__"},
    "pybullet": {"sim"},
    "mujoco": {"sim", "baselines", "export"},
    "torch": {"learn", "baselines"},
    "lightning": {"learn"},
    "onnx": {"learn", "tracking"},
    "onnxruntime": {"learn"},
    "osqp": {"control"},
    "pysindy": {"baselines"},
    "cma": {"identify", "baselines"},
    "pymoo": {"identify"},
    "can": {"hardware", "importing"},
    "cantools": {"hardware", "importing"},
    "serial": {"hardware"},
}
FILES = sorted(path for path in PACKAGE.rglob("*.py") if path.parent != PACKAGE or path.name != "__init__.py")


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} line {node.lineno}: import by the full name"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_imports_point_one_way(path: Path):
    room = path.relative_to(PACKAGE).with_suffix("").parts[0]
    for name in _imports(path):
        package, *inner = name.split(".")
        assert room in ALLOWED_IN.get(package, {room}), f"{package} may be imported only in {ALLOWED_IN[package]}"
        if package == "wipx" and inner[0] != room:
            assert RANK[inner[0]] < RANK[room], f"{room} must not import {name}"
            in_words = inner[:2] == ["effects", "words"]
            assert room != "report" or inner[0] == "core" or in_words, f"report reads finished results only, not {name}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "proof" / "blind_robots").rglob("*.py")), ids=lambda path: path.stem)
def test_blind_robots_share_no_physics_with_what_is_fitted(path: Path):
    for name in _imports(path):
        package, *inner = name.split(".")
        own = inner[:2] == ["proof", "blind_robots"]
        assert package != "wipx" or own or inner[0] == "core", f"{path.stem} must not import {name}"


@pytest.mark.parametrize("path", sorted((PACKAGE / "diagnosis").rglob("*.py")), ids=lambda path: path.stem)
def test_rooms_of_the_diagnosis_are_used_in_one_order(path: Path):
    room = path.relative_to(PACKAGE / "diagnosis").with_suffix("").parts[0]
    for name in _imports(path):
        if name.startswith("wipx.diagnosis."):
            other = name.split(".")[2]
            assert other == room or RANK_IN_DIAGNOSIS[other] < RANK_IN_DIAGNOSIS[room], f"{room} must not import {name}"
