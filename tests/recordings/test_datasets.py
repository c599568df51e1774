"""The example sets and the datasets of `conf/recordings`, where they are at hand."""

import os
from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.core.recording import Recording
from wipx.recordings.source import RecordingSource

ROOT = Path(__file__).parents[2]
EXAMPLES = Path(os.environ.get("WIPX_EXAMPLES", ROOT / "../shared/examples"))
RECORDINGS = Path(os.environ.get("WIPX_RECORDINGS", ROOT / "../shared/recordings"))
ARMS = Path(os.environ.get("WIPX_ARMS", ROOT / "../shared/arms"))
FOLDERS = {
    "${oc.env:WIPX_RECORDINGS,../shared/recordings}": RECORDINGS,
    "${oc.env:WIPX_ARMS,../shared/arms}": ARMS,
}
SETS = [
    f"{name}/{part}"
    for name in ("nothing_missing", "one_effect", "pendulum", "two_effects")
    for part in ("visible", "unseen")
]
DATASETS = sorted(path.stem for path in (ROOT / "conf/recordings").glob("*.yaml") if path.stem != "folder")


def settings_of(dataset: str) -> dict:
    text = (ROOT / f"conf/recordings/{dataset}.yaml").read_text()
    for written, folder in FOLDERS.items():
        text = text.replace(written, str(folder))
    return yaml.safe_load(text)


def source_of(dataset: str) -> RecordingSource:
    settings = settings_of(dataset)
    if not Path(settings["path"]).is_dir():
        pytest.skip(f"{settings['path']} is not here; set WIPX_RECORDINGS, for arms WIPX_ARMS")
    del settings["_target_"]
    return RecordingSource(**settings)


def rate_and_acceleration(recording: Recording, column: str) -> tuple[np.ndarray, np.ndarray]:
    rate = np.gradient(recording[column], recording.t)
    return rate, np.gradient(rate, recording.t)


@pytest.mark.parametrize("name", SETS)
def test_example_set_loads(name: str):
    if not EXAMPLES.is_dir():
        pytest.skip(f"{EXAMPLES} is not here; set WIPX_EXAMPLES")
    source = RecordingSource(path=str(EXAMPLES / name))
    recordings = source.load()
    robot = source.describe()
    assert len(recordings) == (6 if name.endswith("visible") else 3)
    assert robot.controller is not None
    assert len(robot.controller.gains[0]) == 2 * len(robot.model.plant.joints)
    assert source.split(recordings).held_out


@pytest.mark.parametrize("dataset", DATASETS)
def test_every_dataset_names_its_class_and_origin(dataset: str):
    settings = settings_of(dataset)
    assert settings["_target_"] == "wipx.recordings.source.RecordingSource"
    assert settings["origin"].startswith("https://")
    assert settings["title"]


@pytest.mark.parametrize("dataset", DATASETS)
def test_every_dataset_describes_a_robot(dataset: str):
    settings = settings_of(dataset)
    del settings["_target_"]
    if "model" in settings["robot"]:  # a file beside the recordings
        tree = source_of(dataset).describe().model.plant.tree
        assert tree is not None
        assert np.linalg.norm(tree.gravity) > 9.0
    else:
        assert RecordingSource(**settings).describe().model.parameters["gravity"] > 9.0


@pytest.mark.parametrize("dataset", DATASETS)
def test_dataset_loads_with_something_to_fit_and_something_held_out(dataset: str):
    source = source_of(dataset)
    recordings = source.load()
    split = source.split(recordings)
    assert split.fit
    assert split.held_out
    plant = source.describe().model.plant
    for recording in recordings:
        assert {*plant.coordinates, *plant.commands} <= set(recording.columns)
        for column in recording.columns.values():
            assert np.all(np.isfinite(column))


@pytest.mark.parametrize("dataset", ["tue_unbalanced_disk", "bam_xl330", "dfki_simple_pendulum", "zhaw_mini_segway"])
def test_pendulum_falls_away_from_upright(dataset: str):
    """The sign of gravity: theta'' grows with sin(theta), 0 upright."""
    slopes = []
    for recording in source_of(dataset).load():
        rate, acceleration = rate_and_acceleration(recording, "theta")
        known = np.column_stack([np.sin(recording["theta"]), rate, recording["u"], np.ones(len(rate))])
        slopes.append(np.linalg.lstsq(known, acceleration)[0][0])
    assert np.median(slopes) > 0.0


def test_pole_of_the_cartpole_follows_the_signs_of_the_contract():
    """theta'' = (cos(theta) x'' + g sin(theta)) m L / (m L^2 + I): both with a plus."""
    source = source_of("sensorsini_cartpole")
    terms, accelerations = [], []
    for recording in source.load():
        _, cart = rate_and_acceleration(recording, "x")
        rate, acceleration = rate_and_acceleration(recording, "theta")
        terms.append(np.column_stack([np.cos(recording["theta"]) * cart, np.sin(recording["theta"]), rate]))
        accelerations.append(acceleration)
    coupling, gravity, _ = np.linalg.lstsq(np.vstack(terms), np.concatenate(accelerations))[0]
    rod = source.describe().model.parameters["com_height"] * 4.0 / 3.0
    # Second differences at 50 Hz and the published error of 4 % in the angle's scale.
    assert coupling == pytest.approx(1.0 / rod, rel=0.15)
    assert gravity == pytest.approx(9.81 / rod, rel=0.15)


def test_held_out_cartpole_runs_are_a_third():
    source = source_of("sensorsini_cartpole")
    split = source.split(source.load())
    assert (len(split.fit), len(split.held_out)) == (27, 13)
