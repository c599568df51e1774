"""Imports point one way, and heavy packages stay in their rooms."""

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "wipx"
LAYERS = (
    {"core"},
    {"effects"},
    {"sim"},
    {"control", "identify", "recordings", "report", "tracking"},
    {"export", "hardware", "learn"},
    {"baselines", "diagnosis", "importing"},
    {"compilation", "library"},
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


def _imports(folder: Path) -> Iterator[tuple[str, str, str]]:
    """Room within the folder, path within the package, and imported name, for every import of the folder's modules."""
    for path in sorted(folder.rglob("*.py")):
        room, where = path.relative_to(folder).with_suffix("").parts[0], path.relative_to(PACKAGE).as_posix()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                yield from ((room, where, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{where} line {node.lineno}: import by the full name"
                yield from ((room, where, f"{node.module}.{alias.name}") for alias in node.names)


def test_imports_point_one_way():
    for room, path, name in _imports(PACKAGE):
        package, *inner = name.split(".")
        assert room in ALLOWED_IN.get(package, {room}), (
            f"{path}: {package} may be imported only in {ALLOWED_IN[package]}"
        )
        if package == "wipx" and room not in ("__init__", inner[0]):
            assert RANK[inner[0]] < RANK[room], f"{path}: {room} must not import {name}"
            in_words = inner[:2] == ["effects", "words"]
            assert room != "report" or inner[0] == "core" or in_words, (
                f"{path}: reads finished results only, not {name}"
            )


def test_blind_robots_share_no_physics_with_what_is_fitted():
    for _, path, name in _imports(PACKAGE / "proof" / "blind_robots"):
        package, *inner = name.split(".")
        own = inner[:2] == ["proof", "blind_robots"]
        assert package != "wipx" or own or inner[0] == "core", f"{path} must not import {name}"


def test_rooms_of_the_diagnosis_are_used_in_one_order():
    for room, path, name in _imports(PACKAGE / "diagnosis"):
        if name.startswith("wipx.diagnosis."):
            other = name.split(".")[2]
            assert other == room or RANK_IN_DIAGNOSIS[other] < RANK_IN_DIAGNOSIS[room], f"{path} must not import {name}"
