"""robot.yaml: what is read, and what is refused in one line."""

import pickle
import re
from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.core.limits import JointLimits
from wipx.core.load import Load
from wipx.recordings.robot_file import ControllerDescription, KnownLoad, read_robot, robot_from_mapping

ARM = Path(__file__).parents[2] / "wipx" / "robots" / "six_axis_arm"
WIP = """
plant: wip
parameters: {body_mass: 2.6, wheel_mass: 1.2, com_height: 0.35, body_inertia: 0.11,
  wheel_inertia: 0.0023, wheel_radius: 0.0625}
"""
COMPLETE = (
    WIP
    + """
uncertainty: {body_inertia: 0.1, pitch/viscous.sigma: 0.5}
effects: {pitch/viscous: {sigma: 2e-2}}
controller: {kind: lqr, gains: [-3.2, 106.0, -6.4, 18.6], rate: 650.0}
signals:
  x: {column: cart_pos_mm, scale: 0.001}
  theta: {column: pitch, unit: deg}
"""
)
LOADED = (
    WIP
    + """
loads:
  m08: {mass: 0.8, height: 0.45, side: -0.18, recordings: "m08_*.csv"}
  m16: {mass: 1.6, height: 0.45, side: 0.0, recordings: "m16_*.csv"}
"""
)


def robot_file(folder: Path, text: str) -> Path:
    path = folder / "robot.yaml"
    path.write_text(text)
    return path


def test_complete_description_is_read(tmp_path: Path):
    robot = read_robot(robot_file(tmp_path, COMPLETE))
    assert robot.model.plant.kind == "wip"
    assert robot.model.parameters["gravity"] == 9.81
    assert robot.model.effects == {"pitch/viscous": {"sigma": 0.02}}
    assert robot.uncertainty == {"body_inertia": 0.1, "pitch/viscous.sigma": 0.5}
    assert robot.controller == ControllerDescription("lqr", ((-3.2, 106.0, -6.4, 18.6),), 650.0)
    assert robot.signals["x"].column == "cart_pos_mm"


def test_optional_parts_may_be_absent_or_empty(tmp_path: Path):
    for text in (WIP, WIP + "effects:\nuncertainty:\ncontroller:\nsignals:\n"):
        robot = read_robot(robot_file(tmp_path, text))
        assert robot.controller is None
        assert not robot.signals
        assert not robot.uncertainty
        assert not robot.model.effects


@pytest.mark.parametrize("text", [COMPLETE, LOADED])
def test_description_pickles(tmp_path: Path, text: str):
    robot = read_robot(robot_file(tmp_path, text))
    copy = pickle.loads(pickle.dumps(robot))
    assert copy.model.parameters == robot.model.parameters
    assert copy.signals == robot.signals
    assert copy.loads == robot.loads


def test_known_loads_belong_to_the_recordings_that_their_patterns_match(tmp_path: Path):
    robot = read_robot(robot_file(tmp_path, LOADED))
    assert robot.loads["m08"] == KnownLoad(Load(0.8, 0.45, -0.18), "m08_*.csv")
    assert robot.load_of("m16_3.csv") == Load(1.6, 0.45, 0.0)
    assert robot.load_of("bare_3.csv") is None


def test_a_recording_that_two_loads_claim_is_named(tmp_path: Path):
    robot = read_robot(robot_file(tmp_path, LOADED.replace("m16_*", "m*")))
    with pytest.raises(InputError, match=r"^m08_1\.csv: claimed by the loads m08 and m16; correct .*$"):
        robot.load_of("m08_1.csv")


def test_two_commands_take_one_row_of_gains_each():
    links = {f"link{i}_{what}": 0.2 for i in (1, 2) for what in ("mass", "length", "com", "inertia")}
    controller = {"kind": "lqr", "gains": [[1, 2, 3, 4], [5, 6, 7, 8]], "rate": 100}
    robot = robot_from_mapping({"plant": "double_pendulum", "parameters": links, "controller": controller}, "here")
    assert robot.controller is not None
    assert robot.controller.gains == ((1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0))


def test_command_in_volts_is_read_with_an_input_gain():
    data = {"plant": "pendulum", "parameters": {"body_mass": 1.0, "com_height": 0.1, "body_inertia": 0.0}}
    signals = {"signals": {"u": {"unit": "V"}}}
    with pytest.raises(InputError, match=re.escape("u is in V, so parameters.input_gain [N m per V] is needed")):
        robot_from_mapping({**data, **signals}, "here")
    robot_from_mapping({**data, **signals, "uncertainty": {"input_gain": 0.5}}, "here")
    data["parameters"] = {**data["parameters"], "input_gain": 0.07}
    assert robot_from_mapping({**data, **signals}, "here").model.parameters["input_gain"] == 0.07


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WIP.replace("body_mass: 2.6, ", ""), "plant wip lacks body_mass [kg]"),
        (WIP.replace("2.6", "-2.6"), "body_mass = -2.6, expected a positive number in kg"),
        (WIP.replace("2.6", "heavy"), "body_mass is 'heavy', expected a number in kg"),
        (WIP.replace("2.6", ".nan"), "body_mass = nan"),
        (WIP.replace("body_mass", "body_maas"), "unknown parameter of plant wip 'body_maas'; did you mean body_mass?"),
        (WIP.replace("plant: wip", "plant: wpi"), "unknown plant 'wpi'; did you mean wip?"),
        (WIP.replace("plant: wip", ""), "plant is missing"),
        ("plant: wip\n", "parameters is missing"),
        (WIP + "paramters: {}\n", "unknown key 'paramters'"),
        (WIP + "plant: cartpole\n", "key plant is given twice; keep one"),
        (WIP + "effects: {pitch/glue: {F_c: 1}}", "unknown effect of plant wip 'pitch/glue'"),
        (WIP + "effects: {pitch/viscous: {}}", "pitch/viscous lacks sigma"),
        (WIP + "effects: {pitch/viscous: 0.1}", "pitch/viscous is 0.1, expected its parameters {sigma: ...}"),
        (WIP + "effects: {pitch/viscous: {sgma: 1}}", "unknown parameter 'sgma'; did you mean sigma?"),
        (WIP + "effects: {pitch/viscous: {sigma: -1}}", "sigma = -1, expected a non-negative number"),
        (WIP + "effects: {pitch/viscous: {sigma: much}}", "sigma is 'much', expected a finite number"),
        (WIP + "effects: [pitch/viscous]", "effects is ['pitch/viscous'], expected names with values"),
        (
            WIP + "effects: {pitch/coulomb: {F_c: 1}, pitch/stribeck: {F_c: 1, F_s: 2, v_s: 0.1}}",
            "describe the same physics; keep one of them",
        ),
        (WIP + "uncertainty: {body_inertia: 0}", "body_inertia is 0, expected a relative standard deviation above 0"),
        (WIP + "uncertainty: {pitch/viscous.sigma: 0.1}", "unknown parameter 'pitch/viscous.sigma'"),
        (WIP.replace("0.11,", "0,") + "uncertainty: {body_inertia: 0.1}", "the value itself is 0"),
        (WIP + "controller: {kind: lqr, gains: [1, 2, 3, 4]}", "controller lacks rate"),
        (WIP + "controller: {kind: lqr, gains: [1, a], rate: 100}", "expected a list of numbers"),
        (WIP + "controller: {kind: lqr, gains: [1, 2], rate: -1}", "rate is -1, expected a frequency above 0 Hz"),
        (WIP + "signals: {x: {unit: deg}}", "signals.x: unit deg is not one of m"),
        (WIP + "loads: {m8: 0.8}", "loads: m8 is 0.8, expected mass, height, side, recordings"),
        (WIP + "loads: [0.8]", "loads is [0.8], expected names with values"),
        (LOADED.replace("mass: 0.8, ", ""), "loads: m08 lacks mass (kg); add it"),
        (LOADED.replace("side: 0.0", "sid: 0.0"), "unknown key 'sid'; did you mean side?"),
        (LOADED.replace("mass: 0.8", "mass: -0.8"), "m08: mass = -0.8, expected a non-negative number of kg"),
        (LOADED.replace("height: 0.45", "height: high"), "m08: height is 'high', expected a number (m, above"),
        (LOADED.replace('"m08_*.csv"', "8"), "m08: recordings is 8, expected a pattern of file names"),
        ("plant: [wip\n", "line 2: not YAML"),
        ("", "the file is empty"),
        ("- wip\n", "the file is a list"),
        (WIP + "3: 4\n", "key 3 is not a name"),
        (
            "plant: !!python/object/apply:os.system [true]\n",
            "line 1: tag !!python/object/apply:os.system is not allowed",
        ),
        ("plant: !shell ls\n", "line 1: tag !shell is not allowed"),
        ("plant: \x07\n", "not YAML"),
    ],
)
def test_description_at_fault_is_named_in_one_line(tmp_path: Path, text: str, said: str):
    path = robot_file(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_robot(path)
    assert str(error.value).startswith(str(path))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_missing_file_is_named(tmp_path: Path):
    with pytest.raises(InputError, match="cannot be read"):
        read_robot(tmp_path / "robot.yaml")


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"knee": {"speed": 2.0}}, "knee"),
        ({"elbow": {"speed": 0.0}}, "elbow: speed is 0.0, expected a number above 0"),
        (
            {"elbow": {"position": [1.0, -1.0]}},
            r"elbow: position is \[1.0, -1.0\], expected the lowest and the highest",
        ),
        ({"elbow": {"torque": 2.0}}, "torque"),
        ({"elbow": 3.0}, "elbow is 3.0, expected e.g."),
    ],
)
def test_limits_at_fault_are_named(limits: dict[str, object], message: str):
    with pytest.raises(InputError, match=message):
        robot_from_mapping({"plant": "robot", "model": "arm.xml", "limits": limits}, "here", ARM)


def test_limits_of_a_joint_are_the_users():
    limits = {"elbow": {"position": [-1, 1.5], "speed": 2.0, "force": 30.0}, "wrist_1": {"speed": 1.0}}
    robot = robot_from_mapping({"plant": "robot", "model": "arm.xml", "limits": limits}, "here", ARM)
    assert robot.limits["elbow"] == JointLimits((-1.0, 1.5), 2.0, 30.0)
    assert robot.limits["wrist_1"] == JointLimits(speed=1.0)


def test_limits_belong_to_robots_from_model_files(tmp_path: Path):
    with pytest.raises(InputError, match="limits"):
        read_robot(robot_file(tmp_path, LOADED + "limits: {translation: {speed: 1.0}}\n"))


def test_a_known_payload_may_hang_below_the_wheel_axis(tmp_path: Path):
    text = WIP + "effects: {geometry/payload: {mass: 0.1, height: -0.05}}"
    assert read_robot(robot_file(tmp_path, text)).model.effects["geometry/payload"]["height"] == -0.05
