"""What recorded forces ask for: laws of joints, drives, links and base."""

import os
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded_arm import ARM, arm, recorded

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.candidates.torque_regression import numbers_by_forces
from wipx.recordings.robot_file import robot_from_mapping
from wipx.recordings.source import RecordingSource

ARMS = Path(os.environ.get("WIPX_ARMS", Path(__file__).parents[4] / "shared" / "arms"))


def asked_for(model: Model, recordings: tuple[Recording, ...]) -> dict[str, float]:
    """Numbers of the effects that the forces ask for."""
    return {name: n.value for name, n in numbers_by_forces(model, recordings).items() if n.asked}


def test_each_joint_is_seen_by_itself(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {
        "shoulder/coulomb": {"F_c": 0.08},
        "shoulder/viscous": {"sigma": 0.03},
        "elbow/rotor_inertia": {"J": 0.006},
        "actuator_elbow/offset": {"F_0": 0.05},
    }
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    for effect, numbers in hidden.items():
        for symbol, value in numbers.items():
            assert found[f"{effect}.{symbol}"] == pytest.approx(value, rel=0.2)


def test_a_counterbalance_is_a_spring_and_no_offset_beside_it(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"shoulder/spring": {"k": 0.4, "q0": -0.7}, "shoulder/coulomb": {"F_c": 0.08}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["shoulder/spring.k"] == pytest.approx(0.4, rel=0.1)
    assert found["shoulder/spring.q0"] == pytest.approx(-0.7, rel=0.1)
    assert found["shoulder/coulomb.F_c"] == pytest.approx(0.08, rel=0.2)
    assert "actuator_shoulder/offset.F_0" not in found


def test_a_link_with_another_centre_of_mass_is_felt_by_the_joints_that_carry_it(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {
        "link_lower/com_offset": {"x": 0.0, "y": 0.03, "z": -0.02},  # along x is the axis of its joint
        "shoulder/coulomb": {"F_c": 0.08},
    }
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["link_lower/com_offset.y"] == pytest.approx(0.03, abs=0.004)
    assert found["link_lower/com_offset.z"] == pytest.approx(-0.02, abs=0.004)
    assert found["shoulder/coulomb.F_c"] == pytest.approx(0.08, rel=0.2)
    assert "shoulder/spring.k" not in found or found["shoulder/spring.k"] < 0.02


def test_a_payload_on_a_link_is_one_and_not_what_several_wrong_numbers_imitate(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    place = np.random.default_rng(fresh_seed).uniform(-0.15, 0.15, 3)
    hidden = {
        "link_lower/payload": {"mass": 0.06, **dict(zip("xyz", place.tolist(), strict=True))},
        "elbow/coulomb": {"F_c": 0.01},
    }
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["link_lower/payload.mass"] == pytest.approx(0.06, rel=0.1)
    assert [found[f"link_lower/payload.{axis}"] for axis in "xyz"] == pytest.approx(place, abs=0.015)
    assert found["elbow/coulomb.F_c"] == pytest.approx(0.01, rel=0.2)
    assert not any(f"link_{link}/com_offset.x" in found for link in ("upper", "lower"))


def test_a_weak_drive_is_told_from_friction(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {
        "actuator_elbow/gain": {"k": 0.75},
        "elbow/viscous": {"sigma": 0.02},
        "shoulder/coulomb": {"F_c": 0.08},
    }
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["actuator_elbow/gain.k"] == pytest.approx(0.75, abs=0.01)
    assert found["elbow/viscous.sigma"] == pytest.approx(0.02, rel=0.05)  # as commanded it would be a third more
    assert found["shoulder/coulomb.F_c"] == pytest.approx(0.08, rel=0.2)
    assert found.get("elbow/coulomb.F_c", 0.0) < 0.005


def test_gears_that_rub_more_under_force(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"shoulder/load_friction": {"K_motor": 0.2, "K_external": 0.1}, "elbow/viscous": {"sigma": 0.02}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["shoulder/load_friction.K_motor"] == pytest.approx(0.2, abs=0.05)
    assert found["shoulder/load_friction.K_external"] == pytest.approx(0.1, abs=0.04)


def test_late_commands_and_late_drives_are_told_apart(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"actuator_shoulder/delay": {"tau": 0.017}, "actuator_elbow/lag": {"tau": 0.03}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["actuator_shoulder/delay.tau"] == pytest.approx(0.017, rel=0.05)
    assert found["actuator_elbow/lag.tau"] == pytest.approx(0.03, rel=0.2)  # between those that have a column
    assert "actuator/delay.tau" not in found


def test_a_delay_of_all_drives_is_one_delay(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    found = asked_for(model, (recorded(model.with_effects({"actuator/delay": {"tau": 0.008}}), fresh_seed),))
    assert found["actuator/delay.tau"] == pytest.approx(0.008, rel=0.05)
    assert not any(f"actuator_{joint}/delay.tau" in found for joint in ("shoulder", "elbow"))


def test_a_drive_that_gives_no_more_and_one_that_ignores_small_commands(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"actuator_shoulder/saturation": {"F_max": 0.8}, "actuator_elbow/dead_zone": {"band": 0.06}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["actuator_shoulder/saturation.F_max"] == pytest.approx(0.8, rel=0.05)
    assert found["actuator_elbow/dead_zone.band"] == pytest.approx(0.06, rel=0.1)
    assert not any(f"actuator_{joint}/gain.k" in found for joint in ("shoulder", "elbow"))


def test_friction_of_a_loaded_gear_and_friction_that_falls_with_speed(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {
        "shoulder/load_friction": {"K_motor": 0.15, "K_external": 0.0},
        "elbow/stribeck": {"F_c": 0.02, "F_s": 0.05, "v_s": 0.5},
    }
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["shoulder/load_friction.K_motor"] + found["shoulder/load_friction.K_external"] == pytest.approx(
        0.15, rel=0.2
    )
    assert found["elbow/stribeck.F_c"] == pytest.approx(0.02, rel=0.5)
    assert found["elbow/stribeck.F_s"] > 1.5 * found["elbow/stribeck.F_c"]


def test_a_sensor_that_is_late_and_one_that_shows_too_much(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"sensor_elbow/delay": {"tau": 0.006}, "sensor_shoulder/scale": {"e": 0.04}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["sensor_elbow/delay.tau"] == pytest.approx(0.006, rel=0.2)
    assert found["sensor_shoulder/scale.e"] == pytest.approx(0.04, rel=0.2)


def test_a_position_drive_that_is_stiffer_than_believed(tmp_path: Path, fresh_seed: int):
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    servo = {"kind": "position", "kp": 20.0, "kd": 0.5}
    mapping = {"plant": "robot", "model": "arm.xml", "drives": {"shoulder": servo, "elbow": servo}}
    model = robot_from_mapping(mapping, "robot.yaml", tmp_path).model
    found = asked_for(model, (recorded(model.with_effects({"actuator_elbow/kp": {"factor": 1.3}}), fresh_seed),))
    assert found["actuator_elbow/kp.factor"] == pytest.approx(1.3, abs=0.03)
    assert "actuator_shoulder/kp.factor" not in found


def test_a_description_that_is_far_too_light_does_not_hide_friction(tmp_path: Path, fresh_seed: int):
    """The heavier a joint, the less its friction would matter."""
    hidden = {name: {"F_c": 0.2} for name in ("shoulder/coulomb", "elbow/coulomb")}
    recording = recorded(arm(tmp_path).with_effects(hidden), fresh_seed)
    light = ARM.replace('mass="0.3" diaginertia="0.004 0.004 0.0005"', 'mass="0.03" diaginertia="4e-4 4e-4 5e-5"')
    (tmp_path / "arm.xml").write_text(light, encoding="utf-8")
    model = robot_from_mapping({"plant": "robot", "model": "arm.xml"}, "robot.yaml", tmp_path).model
    found = asked_for(model, (recording,))
    assert found["shoulder/coulomb.F_c"] == pytest.approx(0.2, rel=0.1)
    assert found["elbow/coulomb.F_c"] == pytest.approx(0.2, rel=0.1)


def test_what_makes_a_joint_weightless_explains_nothing(tmp_path: Path, fresh_seed: int):
    """A joint that is five times lighter behind a drive without force would leave hardly any error in the forces."""
    model = arm(tmp_path)
    found = asked_for(model, (recorded(model.with_effects({"actuator_elbow/backlash": {"gap": 0.05}}), fresh_seed),))
    assert 0.5 < found.get("actuator_elbow/gain.k", 1.0) < 2.0
    assert found.get("actuator_elbow/dead_zone.band", 0.0) < 0.4  # half of the largest command
    assert found.get("actuator_elbow/saturation.F_max", 1.0) > 0.05


def test_a_tilted_base_is_told_from_centres_of_mass(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"environment/base_tilt": {"roll": 0.06, "pitch": -0.04}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["environment/base_tilt.roll"] == pytest.approx(0.06, abs=0.01)
    assert found["environment/base_tilt.pitch"] == pytest.approx(-0.04, abs=0.01)


def test_sizes_do_not_depend_on_how_much_recordings_are_smoothed(tmp_path: Path, fresh_seed: int):
    """Of products of smoothed signals the sizes would be some per cent off."""
    model = arm(tmp_path)
    hidden = {"link_lower/com_offset": {"x": 0.0, "y": 0.03, "z": -0.02}}
    found = asked_for(model, (recorded(model.with_effects(hidden), fresh_seed),))
    assert found["link_lower/com_offset.y"] == pytest.approx(0.03, rel=0.02)
    assert found["link_lower/com_offset.z"] == pytest.approx(-0.02, rel=0.05)


def test_nothing_much_is_asked_for_where_nothing_is_missing(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    found = asked_for(model, (recorded(model, fresh_seed),))
    sizes = {"F_c": 0.5, "F_0": 0.5, "sigma": 0.2, "J": 0.1, "k": 0.5, "q0": np.inf}  # of what moves the joints
    sizes |= dict.fromkeys("xyz", 0.3)  # length of a link
    assert all(abs(value) < 0.01 * sizes[name.rpartition(".")[2]] for name, value in found.items())


def test_what_the_owner_knows_is_not_asked_for_again(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path).with_effects({"shoulder/coulomb": {"F_c": 0.08}})
    found = asked_for(model, (recorded(model, fresh_seed),))
    assert "shoulder/coulomb.F_c" not in found


def test_of_a_joint_at_rest_forces_say_nothing_of_its_motion(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    recording = recorded(model, fresh_seed)
    still = {**recording.columns, "elbow": np.zeros(len(recording)), "u_elbow": np.zeros(len(recording))}
    found = numbers_by_forces(model, (Recording("r1.csv", still),))
    assert "elbow/viscous.sigma" not in found
    assert np.isfinite(found["shoulder/viscous.sigma"].deviation)


def real_arm(name: str) -> RecordingSource:
    """The recordings of an arm that its diagnosis may see."""
    folder = ARMS / name / "visible"
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing: recordings of real arms; WIPX_ARMS names their folder")
    return RecordingSource(path=str(folder))


@pytest.mark.slow
def test_axis_two_of_a_real_arm_has_the_friction_and_the_rotor_of_its_maker_beside_the_counterbalance():
    source = real_arm("kuka_kr300")
    found = asked_for(source.describe().model, source.load())
    assert found["A2/coulomb.F_c"] == pytest.approx(490.0, rel=0.2)  # Weigand et al. 2021
    assert found["A2/rotor_inertia.J"] == pytest.approx(844.0, rel=0.2)
    assert found["A2/spring.k"] > 3000.0


@pytest.mark.slow
def test_friction_that_takes_nearly_all_force_of_a_real_wrist_is_no_share_of_that_force():
    source = real_arm("staubli_tx40")
    found = asked_for(source.describe().model, source.load())
    assert found["joint_4/coulomb.F_c"] == pytest.approx(2.48, rel=0.2)  # as the authors have it
    assert found["joint_4/viscous.sigma"] == pytest.approx(1.11, rel=0.2)
    assert "joint_4/load_friction.K_motor" not in found


@pytest.mark.slow
def test_the_light_wrist_of_a_real_description_does_not_hide_the_arms_friction():
    source = real_arm("ur10_unisa")
    found = asked_for(source.describe().model, source.load())
    friction = {"shoulder_pan": 13.9, "shoulder_lift": 17.2, "elbow": 9.4}  # Petrone et al. 2025 [N m]
    for joint, size in friction.items():
        assert found[f"{joint}_joint/coulomb.F_c"] == pytest.approx(size, rel=0.3)
