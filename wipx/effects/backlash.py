"""Backlash: the drive crosses a gap before it pushes the other way.

The free drive is a mass in grease that the force moves; contact is inelastic. A share of the momentum that the
drive gathers in the gap is handed to the joint when they meet: all of it where the drive's mass counts with that of the
joint, so that the force is only late; none where it is lost in the frame, so that the force is missing in the gap.
Flanks give way: what is passed on reaches the joint with a first-order lag, of which nothing is lost. It is at most a
millisecond: what takes longer is a delay or a lag of the actuator.
A free drive as heavy as what it drives is outside this law: it would lose contact to the acceleration that it
causes itself.
"""

from wipx.core.effect import Effect, NonSmooth
from wipx.core.law import clip, law, maximum, minimum
from wipx.core.parameters import Parameter
from wipx.effects.lag import rate_of

EFFECT = Effect(
    kind="backlash",
    words="backlash of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter(
            "gap",
            "play at the wheel's rim or the joint",
            "coordinate",
            0.0,
            0.0,
            0.3,
            2e-3,
            grid=(1e-3, 3e-3, 1e-2, 3e-2),
        ),
        Parameter(
            "drive_inertia",
            "of the free drive, at the same place",
            "inertia",
            1.0,
            1e-4,
            0.3,
            0.02,
            grid=(0.01, 0.08),
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
            grid=(0.0, 0.3),
            default=0.0,
        ),
        Parameter(
            "returned",
            "share of the free drive's momentum that the joint gets",
            "ratio",
            0.0,
            0.0,
            1.0,
            0.5,
            grid=(0.0, 1.0),
            default=0.0,
        ),
        Parameter(
            "contact_time",
            "that flanks take to pass a force on",
            "time",
            0.0,
            0.0,
            1e-3,
            5e-4,
            default=0.0,
        ),
    ),
    law="0 while the drive crosses the gap, F in contact",
    linear_in=("gap",),
    doubt=0.25,  # another drive crosses the gap in another way
    source="Nordin, Gutman 2002, Controlling mechanical systems with backlash, Automatica 38(10)",
    rows={
        "GAP": "gap",
        "DRIVE_INERTIA": "drive_inertia",
        "DRIVE_DAMPING": "drive_damping",
        "RETURNED": "returned",
        "CONTACT_RATE": lambda p, body: rate_of(p["contact_time"]),
    },
    parts=("BACKLASH",),
    scan="gaps",
    # A wide gap before a light drive is crossed as a narrow one, and late flanks have the place of a delay.
    non_smooth=NonSmooth(
        ridge={"gap": 1.0, "drive_inertia": -1.0, "drive_damping": -1.0}, imitates={"contact_time": "delay"}
    ),
)

HEAVIEST = 0.9  # of the driven inertia, up to which the two are solved together


@law
def cross(place, speed, force, rest_acceleration, lightness, gap, drive_inertia, drive_damping, returned, step):
    """Move the drive by one `step` in its gap.

    Args:
        place: Drive relative to the driven side, in [-gap/2, gap/2] [m or rad].
        speed: Its rate.
        force: What the motor gives [N or N m].
        rest_acceleration: What the driven side has of all other forces, in the last step.
        lightness: Its acceleration by a force of one.
        gap: Total play.
        drive_inertia: Of the free drive [kg or kg m^2].
        drive_damping: On its way through the gap [N s/m or N m s/rad].
        returned: Share of the drive's momentum that the joint gets, 0 to 1.
        step: Length of the step [s].

    Returns:
        New place, new speed, and the mean force on the joint during the step [N or N m].
    """
    half = 0.5 * gap
    # Newton's law of the drive, and of the joint with what the drive returns to it, solved together.
    apart = 1.0 - returned * minimum(drive_inertia * lightness, HEAVIEST)
    pushed = speed + step * (force / drive_inertia - rest_acceleration / apart)
    moved_speed = pushed / (1.0 + step * drive_damping / (drive_inertia * apart))
    way = step * moved_speed
    target = place + way
    new_place = clip(target, -half, half)
    blocked = target - new_place
    share = clip(blocked / way, 0.0, 1.0) if blocked != 0.0 else 0.0
    new_speed = 0.0 if blocked != 0.0 else moved_speed
    pushed_on = force * share if new_place * force > 0.0 else 0.0
    handed_on = force - drive_inertia * (new_speed - speed) / maximum(step, 1e-12)  # what does not stay in the drive
    return new_place, new_speed, pushed_on + returned * (handed_on - pushed_on)
