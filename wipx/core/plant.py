"""The plants: which parameters, joints, inputs, sensors and sites each kind of mechanism has.

The equations of motion are those of contract section 2; `wipx.sim.coefficients` turns the
parameters into the coefficients of these equations.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from wipx.core.drive import Drive
from wipx.core.errors import InputError, unknown_name
from wipx.core.tree import Link, Tree

COMMON_SITES = ("actuator", "geometry", "environment")


@dataclass(frozen=True)
class PlantParameter:
    """A number of the rigid body.

    Attributes:
        unit: SI unit.
        meaning: What it is, in words.
        default: Value when the owner gives none; None where one must be given.
        sign: "positive", "non-negative" or "any".
        absolute: Whether its uncertainty is in its own unit, not relative.
    """

    unit: str
    meaning: str
    default: float | None = None
    sign: str = "positive"
    absolute: bool = False


@dataclass(frozen=True)
class Plant:
    """A kind of mechanism.

    Attributes:
        kind: Name, e.g. "wip".
        parameters: The numbers of its rigid body by name.
        columns: Recorded column of each joint's coordinate, by joint site.
        commands: Recorded columns of the commands.
        actuated: Joint site on which each command acts.
        sliding: Joint sites that slide; the others turn.
        tree: Links and joints of a robot that a model file describes; None for the other plants.
        drives: What moves each joint of such a robot, by joint.
    """

    kind: str
    parameters: Mapping[str, PlantParameter]
    columns: Mapping[str, str]
    commands: tuple[str, ...]
    actuated: tuple[str, ...]
    sliding: frozenset[str]
    tree: Tree | None = field(default=None, compare=False)
    drives: Mapping[str, Drive] = field(default_factory=dict)

    def __reduce__(self):
        # Mapping proxies do not pickle.
        if self.tree is None:
            return plant_of, (self.kind,)
        return robot_plant, (self.tree, dict(self.drives))

    @property
    def joints(self) -> tuple[str, ...]:
        """Sites of the joints, in the order of the coordinates q."""
        return tuple(self.columns)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Recorded columns of the joints' coordinates, in the order of q."""
        return tuple(self.columns.values())

    @property
    def rates(self) -> tuple[str, ...]:
        """Recorded columns of the joints' rates (optional in a recording), in the order of q."""
        return tuple(f"{name}_dot" for name in self.coordinates)

    @property
    def sites(self) -> tuple[str, ...]:
        """Every site at which physics can be missing."""
        sensors = tuple(f"sensor_{column}" for column in self.coordinates)
        if self.tree is None:
            return (*self.joints, *COMMON_SITES, *sensors)
        drives = tuple(f"actuator_{joint}" for joint in self.actuated)
        links = tuple(f"link_{link.body}" for link in self.tree.links if link.mass)
        return (*self.joints, "actuator", *drives, *sensors, *links, "environment")

    def shows(self, site: str, kind: str) -> bool:
        """Whether recordings can show an effect of that kind at a site, with the commands that they have."""
        drive = self.drives.get(self.joint_at(site)) if self.drives else None
        if drive is None or drive.kind == "none" or not (site in self.columns or site.startswith("actuator")):
            return True
        return drive.shows(kind, at_joint=site in self.columns)

    def class_of(self, site: str) -> str:
        """How effects name a site among those at which they can act (`wipx.core.effect.Effect.sites`).

        The sites of a robot from a model file are classes: "joint", "drive", "drives" (all at once), "sensor", "link",
        "base"; those of the other plants stand for themselves.
        """
        if self.tree is None:
            return site
        if site in self.columns:
            return "joint"
        first = site.partition("_")[0]
        return {"actuator": "drives" if site == "actuator" else "drive", "environment": "base"}.get(first, first)

    def is_angular(self, site: str) -> bool:
        """Whether forces at `site` are torques: turning joints, their actuators and sensors."""
        if site in self.columns or site.startswith(("sensor_", "actuator")):
            return self.joint_at(site) not in self.sliding
        return False

    def joint_at(self, site: str) -> str:
        """The joint that physics at `site` is felt at first.

        Itself, that of a sensor, a drive or the link that it moves, else the first driven one.
        """
        if site in self.columns:
            return site
        return self._felt_at.get(site, self.actuated[0] if self.actuated else self.joints[0])

    @cached_property
    def _felt_at(self) -> dict[str, str]:
        """Joints of sensors, drives and links."""
        found = {f"sensor_{column}": joint for joint, column in self.columns.items()}
        found |= {f"actuator_{joint}": joint for joint in self.actuated}
        if self.tree is not None:
            found |= {f"link_{link.body}": link.joint for link in self.tree.links}
        return found

    def joints_at(self, site: str) -> tuple[str, ...]:
        """The joints at which an effect at `site` acts: all that are driven for a common actuator."""
        if site == "actuator":
            return self.actuated
        return (self.joints[0],) if site == "environment" else (self.joint_at(site),)

    def unit_of(self, column: str) -> str:
        """SI unit of a recorded column."""
        if column == "t":
            return "s"
        measured = {f"{name}_measured": name for name in self.commands}
        command = measured.get(column, column)
        if command in self.commands:
            joint = self.actuated[self.commands.index(command)]
            slides = joint in self.sliding
            if column == command and joint in self.drives and self.drives[joint].kind == "position":
                return "m" if slides else "rad"
            return "N" if slides else "N m"
        name = column.removesuffix("_ref")
        joints = {coordinate: joint for joint, coordinate in self.columns.items()}
        unit = "m" if joints[name.removesuffix("_dot")] in self.sliding else "rad"
        return f"{unit}/s" if name.endswith("_dot") else unit

    def complete(self, values: Mapping[str, float], where: str) -> dict[str, float]:
        """Check the owner's parameters and fill in the optional ones.

        Args:
            values: Parameters as the owner gives them [SI].
            where: File or key that holds them, for error messages.

        Raises:
            InputError: a parameter is missing, unknown, not a number or of the wrong sign.
        """
        for name in values:
            if name not in self.parameters:
                raise unknown_name(f"parameter of plant {self.kind}", name, self.parameters, where)
        return {name: self._checked(name, spec, values, where) for name, spec in self.parameters.items()}

    def _checked(self, name: str, spec: PlantParameter, values: Mapping[str, object], where: str) -> float:
        value = values.get(name, spec.default)
        if value is None:
            raise InputError(f"{where}: plant {self.kind} lacks {name} [{spec.unit}] ({spec.meaning}); add it")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{where}: {name} is {value!r}, expected a number in {spec.unit} ({spec.meaning})")
        bad = (spec.sign == "positive" and value <= 0.0) or (spec.sign == "non-negative" and value < 0.0)
        if bad or not abs(value) < float("inf"):
            raise InputError(
                f"{where}: {name} = {value:g}, expected a {spec.sign} number in {spec.unit} ({spec.meaning})"
            )
        return float(value)


REFERENCES = ("x_ref", "theta_ref", "x_dot_ref")  # columns of references that a recording may have

_GRAVITY = PlantParameter("m/s^2", "gravity", 9.81)
_GAIN = PlantParameter("N or N m per unit of u", "input gain", 1.0, "any")
_BODY = {
    "body_mass": PlantParameter("kg", "mass of the body, m_b"),
    "wheel_mass": PlantParameter("kg", "mass of the wheels or the cart, m_w", sign="non-negative"),
    "com_height": PlantParameter("m", "from the wheel axis to the body's centre of mass, L"),
    "body_inertia": PlantParameter("kg m^2", "of the body about its centre of mass, I_b", sign="non-negative"),
    "wheel_inertia": PlantParameter("kg m^2", "of the wheels, I_w", sign="non-negative"),
    "wheel_radius": PlantParameter("m", "wheel radius, r"),
    "gravity": _GRAVITY,
    "input_gain": _GAIN,
}


def _link(number: int) -> dict[str, PlantParameter]:
    return {
        f"link{number}_mass": PlantParameter("kg", f"mass of link {number}"),
        f"link{number}_length": PlantParameter("m", f"from joint {number} to the end of link {number}"),
        f"link{number}_com": PlantParameter("m", f"from joint {number} to the link's centre of mass"),
        f"link{number}_inertia": PlantParameter("kg m^2", f"of link {number} about its joint"),
    }


def _plant(kind: str, parameters: Mapping[str, PlantParameter], columns: dict[str, str], actuated: tuple[str, ...]):
    commands = ("u",) if len(actuated) == 1 else tuple(f"u{i + 1}" for i in range(len(actuated)))
    sliding = frozenset({"translation"} & columns.keys())
    return Plant(kind, MappingProxyType(dict(parameters)), MappingProxyType(columns), commands, actuated, sliding)


_WHEEL_FREE = {
    **_BODY,
    "wheel_inertia": PlantParameter("kg m^2", "of the wheels (a cart has none)", 0.0, "non-negative"),
    "wheel_radius": PlantParameter("m", "pulley radius, used by ripple only", 1.0),
}
PLANTS = MappingProxyType(
    {
        "wip": _plant("wip", _BODY, {"translation": "x", "pitch": "theta"}, ("translation",)),
        "cartpole": _plant("cartpole", _WHEEL_FREE, {"translation": "x", "pitch": "theta"}, ("translation",)),
        "pendulum": _plant(
            "pendulum",
            {name: _BODY[name] for name in ("body_mass", "com_height", "body_inertia", "gravity", "input_gain")},
            {"pitch": "theta"},
            ("pitch",),
        ),
        "linear_axis": _plant(
            "linear_axis",
            {
                "body_mass": PlantParameter("kg", "mass of the body, m_b", sign="non-negative"),
                **{n: _WHEEL_FREE[n] for n in ("wheel_mass", "wheel_inertia", "wheel_radius", "gravity", "input_gain")},
            },
            {"translation": "x"},
            ("translation",),
        ),
        "double_pendulum": _plant(
            "double_pendulum",
            {**_link(1), **_link(2), "gravity": _GRAVITY, "input_gain": _GAIN},
            {"joint1": "theta1", "joint2": "theta2"},
            ("joint1", "joint2"),
        ),
    }
)


def plant_of(kind: str, where: str = "plant") -> Plant:
    """The plant of that name.

    Raises:
        InputError: there is none; the message lists the valid names.
    """
    if kind not in PLANTS:
        raise unknown_name("plant", kind, PLANTS, where)
    return PLANTS[kind]


def _link_numbers(link: Link) -> dict[str, PlantParameter]:
    """Numbers of a link of a robot from a model file."""
    body = link.body
    com = link.body_rotation.T @ (link.com - link.body_place)
    numbers = {f"{body}.mass": PlantParameter("kg", f"mass of {body}", link.mass, "non-negative")}
    for axis, place in zip("xyz", com.tolist(), strict=True):
        meaning = f"centre of mass of {body} along {axis} of its frame"
        numbers[f"{body}.com_{axis}"] = PlantParameter("m", meaning, place, "any", absolute=True)
    return numbers | {f"{body}.inertia": PlantParameter("1", f"scale of the inertia of {body}", 1.0)}


def robot_plant(tree: Tree, drives: Mapping[str, Drive]) -> Plant:
    """The plant of a robot that a model file describes; contract section 6.

    Args:
        tree: Its links and joints.
        drives: What moves each joint; joints that are left out have a torque drive.
    """
    full = {link.joint: drives.get(link.joint, Drive()) for link in tree.links}
    parameters: dict[str, PlantParameter] = {}
    for link in tree.links:
        if link.mass:
            parameters |= _link_numbers(link)
        unit = "N s/m" if link.slides else "N m s/rad"
        force, inertia = ("N", "kg") if link.slides else ("N m", "kg m^2")
        for name, of, value in (
            ("damping", unit, link.damping),
            ("friction", force, link.friction),
            ("armature", inertia, link.armature),
        ):
            parameters[f"{link.joint}.{name}"] = PlantParameter(of, f"{name} of {link.joint}", value, "non-negative")
        drive = full[link.joint]
        if drive.kind == "torque":
            parameters[f"{link.joint}.gain"] = PlantParameter(f"{force} per unit", "of the drive", drive.gain, "any")
        if drive.kind == "position":
            stiffness = "N/m" if link.slides else "N m/rad"
            parameters[f"{link.joint}.kp"] = PlantParameter(stiffness, "of the drive", drive.kp)
            parameters[f"{link.joint}.kd"] = PlantParameter(unit, "of the drive", drive.kd, "non-negative")
    actuated = tuple(joint for joint, drive in full.items() if drive.kind != "none")
    return Plant(
        "robot",
        MappingProxyType(parameters),
        MappingProxyType({joint: joint for joint in tree.joints}),
        tuple(f"u_{joint}" for joint in actuated),
        actuated,
        frozenset(link.joint for link in tree.links if link.slides),
        tree,
        MappingProxyType(full),
    )
