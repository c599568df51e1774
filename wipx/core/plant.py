"""The plants: which parameters, joints, inputs, sensors and sites each kind of mechanism has.

The equations of motion are those of contract section 2; `wipx.sim.coefficients` turns the
parameters into the coefficients of these equations.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from wipx.core.errors import InputError, unknown_name

COMMON_SITES = ("actuator", "geometry", "environment")


@dataclass(frozen=True)
class PlantParameter:
    """A number of the rigid body.

    Attributes:
        unit: SI unit.
        meaning: What it is, in words.
        default: Value when the owner gives none; None where one must be given.
        sign: "positive", "non-negative" or "any".
    """

    unit: str
    meaning: str
    default: float | None = None
    sign: str = "positive"


@dataclass(frozen=True)
class Plant:
    """A kind of mechanism.

    Attributes:
        kind: Name, e.g. "wip".
        parameters: The numbers of its rigid body by name.
        columns: Recorded column of each joint's coordinate, by joint site.
        commands: Recorded columns of the commands.
        actuated: Joint site on which each command acts.
    """

    kind: str
    parameters: Mapping[str, PlantParameter]
    columns: Mapping[str, str]
    commands: tuple[str, ...]
    actuated: tuple[str, ...]

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
        return tuple(RATE_OF[name] for name in self.coordinates)

    @property
    def sites(self) -> tuple[str, ...]:
        """Every site at which physics can be missing."""
        sensors = tuple(f"sensor_{column}" for column in self.coordinates)
        return (*self.joints, *COMMON_SITES, *sensors)

    def is_angular(self, site: str) -> bool:
        """Whether forces at `site` are torques: turning joints and the actuator of a turning joint."""
        if site in self.columns:
            return self.columns[site] != "x"
        if site.startswith("sensor_"):
            return site != "sensor_x"
        if site == "actuator":
            return self.columns[self.actuated[0]] != "x"
        return False

    def joint_at(self, site: str) -> str:
        """The joint that physics at `site` is felt at first: itself, that of a sensor, else the driven one."""
        if site in self.columns:
            return site
        measured = {f"sensor_{column}": joint for joint, column in self.columns.items()}
        return measured.get(site, self.actuated[0])

    def unit_of(self, column: str) -> str:
        """SI unit of a recorded column."""
        if column in self.commands or column.startswith("u"):
            return "N m" if self.is_angular("actuator") else "N"
        return COLUMN_UNITS[column]

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


RATE_OF = MappingProxyType({"x": "x_dot", "theta": "theta_dot", "theta1": "theta1_dot", "theta2": "theta2_dot"})
COLUMN_UNITS = MappingProxyType(
    {
        "t": "s",
        "x": "m",
        "theta": "rad",
        "theta1": "rad",
        "theta2": "rad",
        "x_dot": "m/s",
        "theta_dot": "rad/s",
        "theta1_dot": "rad/s",
        "theta2_dot": "rad/s",
        "x_ref": "m",
        "theta_ref": "rad",
        "x_dot_ref": "m/s",
    }
)

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
    return Plant(kind, MappingProxyType(dict(parameters)), MappingProxyType(columns), commands, actuated)


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
