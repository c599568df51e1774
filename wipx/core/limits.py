"""Limits of a joint that no experiment may leave."""

from dataclasses import dataclass


@dataclass(frozen=True)
class JointLimits:
    """Of one joint; None for no limit.

    Attributes:
        position: Lowest and highest position [rad or m].
        speed: Largest speed [rad/s or m/s].
        force: Largest force of the drive [N m or N].
    """

    position: tuple[float, float] | None = None
    speed: float | None = None
    force: float | None = None

    def within(self, other: "JointLimits") -> "JointLimits":
        """The narrower of both limits."""
        position = [each for each in (self.position, other.position) if each is not None]
        speed = [each for each in (self.speed, other.speed) if each is not None]
        force = [each for each in (self.force, other.force) if each is not None]
        return JointLimits(
            (max(low for low, _ in position), min(high for _, high in position)) if position else None,
            min(speed, default=None),
            min(force, default=None),
        )
