"""Backlash: the drive crosses a gap before it pushes the other way.

The free drive is a small mass in grease that the force moves; contact is inelastic. The drive's
own momentum is not handed to the wheel, being small; a free drive as heavy as what it drives
is outside this law: it would lose contact to the acceleration that it causes itself.
"""

from wipx.core.effect import Effect
from wipx.core.law import clip, law
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="backlash",
    sites=("actuator",),
    parameters=(
        Parameter(
            "gap",
            "play at the wheel's rim or the joint",
            "coordinate",
            0.0,
            0.0,
            0.3,
            2e-3,
            grid=(5e-4, 2e-3, 1e-2, 3e-2),
        ),
        Parameter(
            "drive_inertia",
            "of the free drive, at the same place",
            "inertia",
            1.0,
            1e-4,
            0.3,
            0.02,
            grid=(0.001, 0.05),
            default=0.05,
        ),
        Parameter(
            "drive_damping",
            "that the free drive has in the gap",
            "damping",
            0.0,
            0.0,
            30.0,
            0.1,
            grid=(0.0, 0.3, 3.0),
            default=0.0,
        ),
    ),
    law="0 while the drive crosses the gap, F in contact",
    source="Nordin, Gutman 2002, Controlling mechanical systems with backlash, Automatica 38(10)",
)


@law
def cross(place, speed, force, joint_acceleration, gap, drive_inertia, drive_damping, step):
    """Move the drive by one `step` in its gap.

    Args:
        place: Drive relative to the driven side, in [-gap/2, gap/2] [m or rad].
        speed: Its rate.
        force: What the motor gives [N or N m].
        joint_acceleration: Of the driven side.
        gap: Total play.
        drive_inertia: Of the free drive [kg or kg m^2].
        drive_damping: On its way through the gap [N s/m or N m s/rad].
        step: Length of the step [s].

    Returns:
        New place, new speed, and the share of the step during which the force is passed on.
    """
    half = 0.5 * gap
    pushed = speed + step * (force / drive_inertia - joint_acceleration)
    moved_speed = pushed / (1.0 + step * drive_damping / drive_inertia)
    way = step * moved_speed
    target = place + way
    new_place = clip(target, -half, half)
    blocked = target - new_place
    share = blocked / way if blocked != 0.0 else 0.0
    return new_place, (0.0 if blocked != 0.0 else moved_speed), clip(share, 0.0, 1.0)
