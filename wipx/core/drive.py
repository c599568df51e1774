"""What moves a joint of a robot that a model file describes; contract section 6."""

from dataclasses import dataclass
from typing import Literal

Logged = Literal["command", "motor", "link"]
BEFORE_THE_MOTOR = (
    "delay",
    "dead_zone",
    "saturation",
    "speed_limit",
    "lag",
)  # effects that its recorded torque has in it
OF_THE_LOOP = ("kp", "kd")  # effects that only a position drive has; factors of its numbers


@dataclass(frozen=True)
class Drive:
    """The drive of one joint.

    Attributes:
        kind: "torque" (force = gain * command), "position" (force = kp (command - q) - kd v, within +-limit) or "none".
        gain: Of a torque drive [N m or N per unit of the command].
        kp: Of a position drive [N m/rad or N/m].
        kd: Likewise [N m s/rad or N s/m].
        limit: Largest force of a position drive [N m or N]; None for no limit.
        rate: Of a position drive's loop [Hz]; None for a continuous one.
        logged: What the recorded command is: what was asked for, what the motor made, or what a sensor behind the gear
            measured.
    """

    kind: Literal["torque", "position", "none"] = "torque"
    gain: float = 1.0
    kp: float = 0.0
    kd: float = 0.0
    limit: float | None = None
    rate: float | None = None
    logged: Logged = "command"

    def shows(self, kind: str, *, at_joint: bool) -> bool:
        """Whether recordings can show an effect of the drive, or of its joint, beside the recorded command."""
        if kind in OF_THE_LOOP:
            return self.kind == "position" and (kind != "kd" or self.kd > 0.0)
        if at_joint:
            return self.logged != "link" or kind in ("rotor_inertia", "spring")
        return self.logged == "command" or kind not in BEFORE_THE_MOTOR
