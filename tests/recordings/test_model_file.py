"""model.yaml: what is written is read again, and nothing else happens."""

from pathlib import Path

import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import PLANTS, plant_of
from wipx.effects.catalogue import vocabulary
from wipx.recordings.model_file import read_model, write_model


def random_model(kind: str, rng: np.random.Generator) -> Model:
    """A model with every effect of the plant that can stand beside the others."""
    plant = plant_of(kind)
    known = vocabulary(plant)
    effects: dict[str, dict[str, float]] = {}
    for name, effect in known.items():
        site = name.partition("/")[0]
        beside = [known[other] for other in effects if other.startswith(f"{site}/")]
        if not any(other.kind in effect.excludes or effect.kind in other.excludes for other in beside):
            effects[name] = {p.name: float(rng.lognormal(sigma=8.0)) for p in effect.parameters}
    return Model(plant, {name: float(rng.lognormal(sigma=8.0)) for name in plant.parameters}, effects)


@pytest.mark.parametrize("kind", PLANTS)
def test_model_comes_back_with_all_digits(tmp_path: Path, kind: str, fresh_seed: int):
    model = random_model(kind, np.random.default_rng(fresh_seed))
    path = tmp_path / "model.yaml"
    write_model(model, path)
    again = read_model(path)
    assert again.plant == model.plant
    assert again.parameters == model.parameters
    assert again.effects == model.effects


def test_numbers_of_numpy_are_written_as_plain_ones(tmp_path: Path):
    model = Model(
        plant_of("pendulum"),
        {name: np.float64(0.1) for name in plant_of("pendulum").parameters},
        {"pitch/coulomb": {"F_c": np.float64(1e-7)}},
    )
    write_model(model, tmp_path / "model.yaml")
    assert read_model(tmp_path / "model.yaml").effects["pitch/coulomb"]["F_c"] == 1e-7


def test_only_the_complete_file_is_left(tmp_path: Path):
    model = random_model("wip", np.random.default_rng(3))
    path = tmp_path / "model.yaml"
    path.write_text("an older one")
    write_model(model, path)
    assert [p.name for p in tmp_path.iterdir()] == ["model.yaml"]
    assert read_model(path).parameters == model.parameters


def test_robot_file_is_a_model_whose_other_keys_are_left_alone(tmp_path: Path):
    path = tmp_path / "robot.yaml"
    path.write_text(
        "plant: pendulum\nparameters: {body_mass: 1, com_height: 0.4, body_inertia: 0.1}\n"
        "signals: {nothing: [of, this]}\nuncertainty: 3\ncontroller: unknown\n"
    )
    assert read_model(path).parameters["com_height"] == 0.4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("schema: 2\nplant: pendulum\nparameters: {}\n", "schema is 2, expected 1"),
        ("schema: 1\nplant: pendulum\nparameters: {body_mass: 1}\n", "lacks com_height"),
        ("schema: 1\nplant: pendulum\neffect: {}\n", "unknown key 'effect'; did you mean effects?"),
    ],
)
def test_model_at_fault_is_named(tmp_path: Path, text: str, said: str):
    path = tmp_path / "model.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_model(path)
    assert said in str(error.value)


def test_reading_runs_no_code(tmp_path: Path):
    trace = tmp_path / "trace"
    path = tmp_path / "model.yaml"
    path.write_text(
        f"plant: !!python/object/apply:pathlib.Path.touch [!!python/object/apply:pathlib.Path ['{trace}']]\n"
    )
    with pytest.raises(InputError, match="line 1: tag !!python"):
        read_model(path)
    assert not trace.exists()


def test_bandwidths_come_back(tmp_path: Path):
    model = Model(
        plant_of("wip"), random_model("wip", np.random.default_rng(1)).parameters, {}, {"x": 3.0, "theta": 10.0}
    )
    write_model(model, tmp_path / "model.yaml")
    assert dict(read_model(tmp_path / "model.yaml").bandwidths) == {"x": 3.0, "theta": 10.0}


@pytest.mark.parametrize(
    ("bandwidths", "said"), [("{y: 3.0}", "y"), ("{x: 3.0}", "theta"), ("{x: -1.0, theta: 1.0}", "x")]
)
def test_bandwidths_at_fault_are_named(tmp_path: Path, bandwidths: str, said: str):
    model = random_model("wip", np.random.default_rng(1))
    path = tmp_path / "model.yaml"
    write_model(Model(model.plant, model.parameters, {}), path)
    path.write_text(path.read_text() + f"bandwidths: {bandwidths}\n")
    with pytest.raises(InputError, match=f"bandwidths.*{said}"):
        read_model(path)
