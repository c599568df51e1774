"""The owner's files of a robot: its model as MJCF or URDF, and robot.yaml; contract section 6."""

from collections.abc import Mapping
from math import atan2

import numpy as np

from wipx.proof.blind_robots.trees.links import Link
from wipx.proof.blind_robots.trees.physics import Drive
from wipx.proof.blind_robots.trees.robots import Robot


def model_name(robot: Robot) -> str:
    """File name of the model."""
    return "robot.urdf" if robot.urdf else "robot.xml"


def model_file(robot: Robot) -> str:
    """Text of the model file."""
    return _urdf(robot) if robot.urdf else _mjcf(robot)


def robot_file(
    robot: Robot, known: Mapping[str, Mapping[str, float]], uncertainty: Mapping[str, float]
) -> dict[str, object]:
    """Content of robot.yaml: what the owner believes.

    Args:
        robot: The robot.
        known: Effects that the owner knows beside what the model file says.
        uncertainty: Relative standard deviations by parameter (of a centre of mass [m]).
    """
    content: dict[str, object] = {"plant": "robot", "model": model_name(robot)}
    drives = {link.joint: _drive(drive) for link, drive in zip(robot.links, robot.drives, strict=True)}
    if said := {joint: drive for joint, drive in drives.items() if drive is not None}:
        content["drives"] = said
    if uncertainty:
        content["uncertainty"] = dict(uncertainty)
    if known:
        content["effects"] = {name: dict(values) for name, values in known.items()}
    return content


def _drive(drive: Drive) -> dict[str, object] | None:
    """A drive in robot.yaml; None where the model file says it all, or where nothing needs to be said."""
    if drive.kind == "none":
        return {"kind": "none"}
    if drive.in_file and drive.logged == "command":
        return None
    if drive.kind == "position":
        content: dict[str, object] = {"kind": "position", "kp": drive.kp, "kd": drive.kd}
        content |= {"limit": drive.limit} if np.isfinite(drive.limit) else {}
        return content | ({} if drive.rate is None else {"rate": drive.rate})
    content = {"kind": "torque", "gain": drive.gain}
    return content | ({"logged": "motor"} if drive.logged == "motor" else {})


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{float(value) + 0.0:.16g}" for value in np.ravel(values))


def _mjcf(robot: Robot) -> str:
    children: dict[int, list[int]] = {}
    for i, link in enumerate(robot.links):
        children.setdefault(link.parent, []).append(i)

    def body(i: int, indent: str) -> list[str]:
        link = robot.links[i]
        below = np.zeros(3) if link.parent < 0 else robot.links[link.parent].origin
        place = link.place + link.turn @ link.origin - below
        lines = [f'{indent}<body name="{link.body}" pos="{_numbers(place)}" quat="{_numbers(quaternion(link.turn))}">']
        lines += [f"{indent}  {line}" for line in (_inertial(link, 1.0 - link.welded, -link.origin), _joint(link))]
        if link.welded:
            spot = 0.4 * link.tip - link.origin
            cover = _inertial(link, link.welded, -link.origin - spot)
            lines.append(f'{indent}  <body name="{link.body}_cover" pos="{_numbers(spot)}">{cover}</body>')
        for child in children.get(i, ()):
            lines += body(child, f"{indent}  ")
        return [*lines, f"{indent}</body>"]

    lines = ['<mujoco model="robot">', '  <compiler angle="radian"/>', "  <worldbody>"]
    for i in children[-1]:
        lines += body(i, "    ")
    lines.append("  </worldbody>")
    actuators = [_actuator(link, drive) for link, drive in zip(robot.links, robot.drives, strict=True) if drive.in_file]
    if actuators:
        lines += ["  <actuator>", *(f"    {line}" for line in actuators), "  </actuator>"]
    return "\n".join([*lines, "</mujoco>"]) + "\n"


def _inertial(link: Link, share: float, shift: np.ndarray) -> str:
    entries = [link.inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    full = _numbers(share * np.array(entries))
    return f'<inertial pos="{_numbers(link.com + shift)}" mass="{share * link.mass:.16g}" fullinertia="{full}"/>'


def _joint(link: Link) -> str:
    kind = "slide" if link.slides else "hinge"
    span = _numbers(np.array(link.limits))
    text = f'<joint name="{link.joint}" type="{kind}" axis="{_numbers(link.axis)}" range="{span}"'
    if link.origin.any():
        text += f' pos="{_numbers(-link.origin)}"'
    for name, value in (("damping", link.damping), ("frictionloss", link.friction), ("armature", link.armature)):
        text += f' {name}="{value:.16g}"' if value else ""
    return f"{text}/>"


def _actuator(link: Link, drive: Drive) -> str:
    if drive.kind == "position":
        limit = f' forcerange="{-drive.limit:.16g} {drive.limit:.16g}"' if np.isfinite(drive.limit) else ""
        gains = f'kp="{drive.kp:.16g}" kv="{drive.kd:.16g}"{limit}'
        return f'<position name="{link.joint}_servo" joint="{link.joint}" {gains}/>'
    return f'<motor name="{link.joint}_motor" joint="{link.joint}" gear="{drive.gain:.16g}"/>'


def _urdf(robot: Robot) -> str:
    lines = ['<robot name="robot">', '  <link name="base"/>']
    for link in robot.links:
        parent = "base" if link.parent < 0 else robot.links[link.parent].body
        lines += [
            f'  <link name="{link.body}">',
            "    <inertial>",
            f'      <origin xyz="{_numbers(link.com)}" rpy="0 0 0"/>',
            f'      <mass value="{link.mass:.16g}"/>',
            f"      <inertia {_moments(link)}/>",
            "    </inertial>",
            "  </link>",
            f'  <joint name="{link.joint}" type="{"prismatic" if link.slides else "revolute"}">',
            f'    <origin xyz="{_numbers(link.place)}" rpy="{_numbers(roll_pitch_yaw(link.turn))}"/>',
            f'    <parent link="{parent}"/>',
            f'    <child link="{link.body}"/>',
            f'    <axis xyz="{_numbers(link.axis)}"/>',
            f'    <limit lower="{link.limits[0]:.16g}" upper="{link.limits[1]:.16g}" effort="1000" velocity="20"/>',
            f'    <dynamics damping="{link.damping:.16g}" friction="{link.friction:.16g}"/>',
            "  </joint>",
        ]
    return "\n".join([*lines, "</robot>"]) + "\n"


def _moments(link: Link) -> str:
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    return " ".join(f'{name}="{link.inertia[at]:.16g}"' for name, at in names.items())


def quaternion(turn: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) of a turn, shape (4,): the eigenvector of Bar-Itzhack 2000."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turn
    matrix = np.array(
        [
            [xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, xx - yy - zz, xy + yx, xz + zx],
            [xz - zx, xy + yx, yy - xx - zz, yz + zy],
            [yx - xy, xz + zx, yz + zy, zz - xx - yy],
        ]
    )
    found = np.linalg.eigh(matrix)[1][:, -1]
    return found * (1.0 if found[0] >= 0.0 else -1.0)


def roll_pitch_yaw(turn: np.ndarray) -> np.ndarray:
    """Angles of URDF: R = Rz(yaw) Ry(pitch) Rx(roll), shape (3,)."""
    across = float(np.hypot(turn[0, 0], turn[1, 0]))
    pitch = atan2(-turn[2, 0], across)
    if across < 1e-9:  # roll and yaw turn about one axis
        return np.array([atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0])
    return np.array([atan2(turn[2, 1], turn[2, 2]), pitch, atan2(turn[1, 0], turn[0, 0])])
