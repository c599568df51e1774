"""`task=predict` on emulated recordings whose missing physics is known."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import yaml

MISSING = {  # README.md of the examples
    "nothing_missing": {},
    "one_effect": {"translation/coulomb": {"F_c": 0.256}},
    "two_effects": {"actuator/delay": {"tau": 0.0171}, "translation/viscous": {"sigma": 1.715}},
    "pendulum": {"pitch/coulomb": {"F_c": 0.0857}},
}


def table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a csv file; an empty cell is NaN."""
    with path.open() as stream:
        header, *rows = csv.reader(stream)
    columns = zip(*rows, strict=True)
    return {name: np.array([float(c or "nan") for c in cells]) for name, cells in zip(header, columns, strict=True)}


def truth(recordings: Path, file: Path, effects: dict) -> Path:
    """A model.yaml: the owner's description with the missing effects."""
    robot = yaml.safe_load((recordings / "robot.yaml").read_text())
    kept = {key: robot[key] for key in ("plant", "parameters")}
    file.write_text(yaml.safe_dump({"schema": 1, **kept, "effects": {**robot.get("effects", {}), **effects}}))
    return file


@pytest.mark.parametrize("name", ["two_effects", "pendulum"])
def test_predictions_have_the_rows_of_the_recordings(program, examples: Path, tmp_path: Path, name: str):
    recordings = examples / name / "unseen"
    answer = program("task=predict", f"recordings.path={recordings}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    files = sorted(path.name for path in recordings.glob("*.csv"))
    out = tmp_path / "out"
    assert sorted(path.name for path in out.iterdir()) == sorted([*files, "config.yaml", "metrics.json"])
    metrics = json.loads((out / "metrics.json").read_text())
    for file in files:
        recorded, predicted = table(recordings / file), table(out / file)
        columns = [c for c in ("x", "theta") if c in recorded]
        assert list(predicted) == ["t", *columns]
        np.testing.assert_allclose(predicted["t"], recorded["t"], rtol=1e-8)
        late = recorded["t"] >= recorded["t"][0] + 0.5
        for column in columns:
            np.testing.assert_array_equal(np.isnan(predicted[column]), ~late)
            rms = np.sqrt(np.nanmean((predicted[column] - recorded[column]) ** 2))
            assert rms == pytest.approx(metrics["recordings"][file][column], rel=1e-4)
    assert metrics["model"] == "nominal"
    assert metrics["horizon_s"] == 0.5
    assert metrics["rms"] == metrics["rms_nominal"]


@pytest.mark.parametrize("name", MISSING)
def test_the_right_model_predicts_to_a_few_noise_floors(program, examples: Path, tmp_path: Path, name: str):
    recordings = examples / name / "unseen"
    model = truth(recordings, tmp_path / "model.yaml", MISSING[name])
    arguments = (f"recordings.path={recordings}", f"model.path={model}", "hydra.run.dir=out")
    assert program("task=predict", *arguments).status == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    for column, error in metrics["rms"].items():
        # The log has the mean of several commands, and the floor is that of the median window:
        # a robot that balances magnifies both in the windows that begin at a reversal.
        assert error < 10.0 * metrics["noise_floor"][column]
        if MISSING[name]:
            assert error < 0.5 * metrics["rms_nominal"][column]


def test_the_same_run_gives_the_same_bytes(program, examples: Path, tmp_path: Path):
    recordings = examples / "pendulum" / "unseen"
    for out in ("first", "second"):
        assert program("task=predict", f"recordings.path={recordings}", f"hydra.run.dir={out}").status == 0
    for path in (tmp_path / "first").glob("r*.csv"):
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()


def test_a_robot_file_is_a_model_file_too(program, folder, tmp_path: Path):
    model = folder.path / "robot.yaml"
    answer = program("task=predict", f"recordings.path={folder.path}", f"model.path={model}", "hydra.run.dir=out")
    assert answer.status == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert metrics["rms"] == metrics["rms_nominal"]


def test_recordings_without_noise_are_predicted(program, folder, tmp_path: Path):
    lines = folder.lines
    (folder.path / "still.csv").write_text("\n".join([lines[0], *(f"{r * 0.01:.2f},3.14159265,0" for r in range(100))]))
    answer = program("task=predict", f"recordings.path={folder.path}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert np.isfinite(table(tmp_path / "out" / "still.csv")["theta"][50:]).all()
