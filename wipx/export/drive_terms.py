"""What MuJoCo can say of the drives of a completed model: gains, servos, limits, lags, delays, ripple.

A drive is an actuator of one of two kinds. A plain one gives gain * input + bias, with limits of input and force, a
filter of the input, and a delay. A drive whose torque falls with speed, or a servo whose torque lags, is a `dcmotor`
with constants that make its voltage a torque: the clamp of the voltage is the torque-speed line, the current's time
constant the lag. MJCF has no dead zones, no backlash and no springs between drives and links.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import copysign, inf

from wipx.core.export_result import Statement, approximated, exact, lost
from wipx.core.model import Model

Limits = tuple[float, float]
FREE: Limits = (-inf, inf)


@dataclass(frozen=True)
class Ripple:
    """A force amplitude * cos(periods * q + phase)."""

    amplitude: float
    periods: float
    phase: float


@dataclass(frozen=True)
class SpeedLine:
    """Driving force limited to stall (1 - abs(v) / free), braking force to stall [N m or N, rad/s or m/s]."""

    stall: float
    free: float


@dataclass(frozen=True)
class DriveTerms:
    """Numbers of the drive of one joint.

    Attributes:
        joint: Its name.
        command: Recorded column of its command.
        servo: Stiffness and damping of a position loop; None for a drive of forces.
        gain: Force per unit of the command of a drive of forces.
        offset: Force beside it.
        inputs: Limits of the command.
        forces: Limits of the force.
        line: Torque-speed line; None without.
        lag: Time constant of the force, 0 for none [s].
        delay: Of the command [s].
        damping: Force lost per speed (back-EMF).
        ripple: None without.
        statements: What became of the drive's effects.
    """

    joint: str
    command: str
    servo: tuple[float, float] | None = None
    gain: float = 1.0
    offset: float = 0.0
    inputs: Limits = FREE
    forces: Limits = FREE
    line: SpeedLine | None = None
    lag: float = 0.0
    delay: float = 0.0
    damping: float = 0.0
    ripple: Ripple | None = None
    statements: tuple[Statement, ...] = field(default=())

    @property
    def is_motor(self) -> bool:
        """Whether only a `dcmotor` says it."""
        return self.line is not None or (self.servo is not None and self.lag > 0.0)


def drive_terms(model: Model, command: str, step: float) -> DriveTerms:
    """What MuJoCo can say of the drive that a command moves.

    Args:
        model: The completed model.
        command: Column of the command.
        step: Of MuJoCo's integrator [s].
    """
    return _Path(model, command, step).terms()


class _Path:
    """The path from the command to the joint, stage by stage as in `wipx.sim.actuator`."""

    def __init__(self, model: Model, command: str, step: float) -> None:
        plant = model.plant
        self.model, self.command, self.step = model, command, step
        self.joint = plant.actuated[plant.commands.index(command)]
        self.site = "actuator" if plant.tree is None else f"actuator_{self.joint}"
        self.said: list[Statement] = []
        drive = plant.drives.get(self.joint)
        self.is_servo = drive is not None and drive.kind == "position"
        self.limit = drive.limit if drive is not None and self.is_servo and drive.limit is not None else inf
        self.rate = drive.rate if drive is not None and self.is_servo else None

    def values(self, kind: str) -> Mapping[str, float] | None:
        """Numbers of an effect of this drive; None where it is absent."""
        return self.model.effects.get(f"{self.site}/{kind}")

    def say(self, kind: str, statement: Callable[[str, str], Statement], how: str) -> None:
        """Note what becomes of an effect."""
        self.said.append(statement(f"{self.site}/{kind}", how))

    def terms(self) -> DriveTerms:
        """All stages together."""
        gain = (self.values("gain") or {"k": 1.0})["k"]
        offset = (self.values("offset") or {"F_0": 0.0})["F_0"]
        lag = (self.values("lag") or {"tau": 0.0})["tau"]
        line = self._line()
        forces, inputs = self._limits(gain, offset, lag, line)
        servo, own = self._source(gain)
        self._say_plain(lag, line)
        damping = self._back_emf(lag, line)
        ripple = self._ripple()
        known = {statement.effect for statement in self.said}
        for name in self.model.effects:
            if name.startswith(f"{self.site}/") and name not in known and not name.endswith("/delay"):
                self.said.append(lost(name, "MJCF has no such law"))
        return DriveTerms(
            self.joint,
            self.command,
            servo,
            own,
            gain * offset,
            inputs,
            forces,
            line,
            lag,
            self._delay(),
            damping,
            ripple,
            tuple(self.said),
        )

    def _source(self, gain: float) -> tuple[tuple[float, float] | None, float]:
        """Stiffness and damping of a servo, or force per unit of the command."""
        if self.is_servo:
            if self.rate is not None:
                self.said.append(
                    approximated(f"{self.joint}.rate", f"a continuous servo in place of one at {self.rate:g} Hz")
                )
            for kind, name in (("kp", "stiffness"), ("kd", "damping")):
                if self.values(kind) is not None:
                    self.say(kind, exact, f"{name} of the position actuator")
            stiffness, damping = self.model.servo(self.joint)
            return (gain * stiffness, gain * damping), 1.0
        return None, self._per_unit(gain)

    def _line(self) -> SpeedLine | None:
        values = self.values("speed_limit")
        if values is None:
            return None
        self.say("speed_limit", approximated, "clamped voltage of a dcmotor, which brakes beyond its free speed")
        return SpeedLine(values["F_stall"], values["v_free"])

    def _limits(self, gain: float, offset: float, lag: float, line: SpeedLine | None) -> tuple[Limits, Limits]:
        """Limits of the force and of the command."""
        largest = (self.values("saturation") or {"F_max": inf})["F_max"]
        low, high = sorted((gain * (offset - self.limit), gain * (offset + self.limit)))
        inputs, forces = FREE, (max(low, -largest), min(high, largest))
        before_the_lag = lag > 0.0 and not self.is_servo and largest < inf
        if before_the_lag:
            per_unit = self._per_unit(gain)
            ends = sorted((sign * largest - gain * offset) / per_unit for sign in (-1.0, 1.0))
            inputs, forces = (ends[0], ends[1]), FREE
        if line is not None:
            forces = (max(forces[0], -line.stall), min(forces[1], line.stall))
        if self.values("saturation") is not None:
            if lag > 0.0 and self.is_servo:
                self.say("saturation", approximated, "forcerange of the actuator, behind the lag")
            else:
                self.say("saturation", exact, "ctrlrange of the actuator" if before_the_lag else "forcerange")
        return forces, inputs

    def _per_unit(self, gain: float) -> float:
        """Force per unit of the command of a drive of forces."""
        name = "input_gain" if self.model.plant.tree is None else f"{self.joint}.gain"
        return gain * self.model.parameters.get(name, 1.0)

    def _say_plain(self, lag: float, line: SpeedLine | None) -> None:
        """Gain, offset and lag."""
        if self.values("gain") is not None:
            self.say("gain", exact, "gain of the actuator")
        if self.values("offset") is not None:
            if line is None and not (self.is_servo and lag > 0.0):
                self.say("offset", exact, "constant force of the actuator")
            else:
                self.say("offset", approximated, "constant force that the limits of the drive do not see")
        if self.values("lag") is not None:
            if not self.is_servo and line is None:
                self.say("lag", exact, "filterexact dynamics of the actuator")
            elif self.limit < inf:
                self.say("lag", approximated, "time constant of a dcmotor's current, before the limit of the servo")
            else:
                self.say("lag", exact, "time constant of a dcmotor's current")

    def _back_emf(self, lag: float, line: SpeedLine | None) -> float:
        values = self.values("back_emf")
        if values is None:
            return 0.0
        if lag > 0.0:
            self.say("back_emf", approximated, "damping of the actuator, which does not lag")
        else:
            self.say("back_emf", exact, "damping of the actuator")
        return values["k_e"]

    def _ripple(self) -> Ripple | None:
        values = self.values("ripple")
        if values is None:
            return None
        self.say("ripple", exact, "cogging torque of a passive dcmotor")
        return Ripple(values["A"], values["n"] / self.model.parameters.get("wheel_radius", 1.0), values["phase"])

    def _delay(self) -> float:
        """Of this drive and of all together; MuJoCo's shortest is one step."""
        names = [name for name in dict.fromkeys((f"{self.site}/delay", "actuator/delay")) if name in self.model.effects]
        delay = sum(self.model.effects[name]["tau"] for name in names)
        written = delay if delay >= self.step else self.step if delay >= 0.5 * self.step else 0.0
        for name in names:
            if written == delay:
                self.said.append(exact(name, "delay of the actuator"))
            else:
                how = "one step" if written else "no delay"
                self.said.append(approximated(name, f"{how}, as it is shorter than a step"))
        return written


def clamped(limits: Limits) -> bool:
    """Whether there is a limit at either side."""
    return limits[0] > -inf or limits[1] < inf


def finite(limits: Limits) -> list[float]:
    """Limits as MJCF takes them."""
    return [copysign(1e12, end) if abs(end) == inf else end for end in limits]
