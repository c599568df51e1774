"""Parameters: a name, a physical dimension, a neutral value and a search interval."""

from dataclasses import dataclass
from math import pi

UNITS = {
    # dimension: (unit at a sliding joint, unit at a turning joint)
    "force": ("N", "N m"),
    "limit": ("N", "N m"),  # of an actuator; measured by the largest command
    "load": ("N", "N m"),  # of an actuator; measured by its usual command
    "velocity": ("m/s", "rad/s"),
    "coordinate": ("m", "rad"),
    "damping": ("N s/m", "N m s/rad"),
    "drag": ("N s^2/m^2", "N m s^2/rad^2"),
    "stiffness": ("N/m", "N m/rad"),
    "inertia": ("kg", "kg m^2"),
    "mass": ("kg", "kg"),
    "length": ("m", "m"),
    "angle": ("rad", "rad"),
    "time": ("s", "s"),
    "moment": ("s", "s"),  # a time of the recording
    "ratio": ("1", "1"),
    "periods": ("1", "1"),  # per turn of the motor; the unit is one period over its whole way
    "per_coordinate": ("1/m", "1/rad"),
    "per_time": ("1/s", "1/s"),
}


@dataclass(frozen=True)
class Scales:
    """Characteristic sizes of one joint; search intervals are multiples of them.

    Attributes:
        force: Force or torque that moves the joint in the recordings [N or N m].
        velocity: Speed that the joint reaches [m/s or rad/s].
        coordinate: Distance or angle that it travels [m or rad].
        mass: Mass of the body [kg].
        length: Size of the body [m].
        duration: Length of a recording [s].
        command: Largest force that was commanded [N or N m].
        usual: Root mean square of the force that was commanded [N or N m].
        turn: Angle between the ends of its way; of the wheel, where the joint slides on one [rad].
    """

    force: float = 1.0
    velocity: float = 1.0
    coordinate: float = 1.0
    mass: float = 1.0
    length: float = 1.0
    duration: float = 10.0
    command: float = 1.0
    usual: float = 1.0
    turn: float = 2.0 * pi

    def of(self, dimension: str) -> float:
        """The characteristic size of a `dimension` of `UNITS`, in its SI unit."""
        return {
            "force": self.force,
            "limit": self.command,
            "load": self.usual,
            "velocity": self.velocity,
            "coordinate": self.coordinate,
            "damping": self.force / self.velocity,
            "drag": self.force / self.velocity**2,
            "stiffness": self.force / self.coordinate,
            "inertia": self.force / self.velocity * 0.1,  # brought to speed in 0.1 s
            "mass": self.mass,
            "length": self.length,
            "angle": 1.0,
            "time": 1.0,
            "moment": self.duration,
            "ratio": 1.0,
            "periods": 2.0 * pi / self.turn,
            "per_coordinate": 1.0,
            "per_time": 1.0,
        }[dimension]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect's law.

    Attributes:
        name: Symbol in the law, e.g. "F_c".
        meaning: What it is, in words.
        dimension: A key of `UNITS`.
        neutral: Value at which the effect is absent [SI].
        low: Lower end of the search interval, in multiples of the joint's `Scales`.
        high: Upper end, likewise.
        start: Where a search begins, likewise.
        grid: Values at which a diagnosis looks for the effect, likewise; empty for `start` alone.
        default: Value where a file gives none [SI]; None where it must give one.
        signed: Whether a file may give a negative number, though a search looks for none.
    """

    name: str
    meaning: str
    dimension: str
    neutral: float
    low: float
    high: float
    start: float
    grid: tuple[float, ...] = ()
    default: float | None = None
    signed: bool = False

    def unit(self, *, angular: bool) -> str:
        """The SI unit at a turning (`angular`) or a sliding joint."""
        return UNITS[self.dimension][angular]


@dataclass(frozen=True)
class FreeParameter:
    """A number that an identification may change.

    Attributes:
        name: "site/kind.symbol" of an effect, or the name of a plant parameter.
        unit: SI unit.
        low: Lower bound [unit].
        high: Upper bound [unit].
        start: Where the search begins [unit].
        neutral: Value before the identification: that of an absent effect, or the nominal one [unit].
        prior_mean: Centre of a prior [unit]; None without a prior.
        prior_std: Its standard deviation [unit].
        of_factor: Whether the prior is one of the factor by which the number is wrong (log-normal), as suits masses,
            inertias and gains, which are never zero; else it is Gaussian.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    neutral: float
    prior_mean: float | None = None
    prior_std: float | None = None
    of_factor: bool = False
