"""Elasticity: a spring between the drive and the link that it moves.

The drive has a state of its own: how far it is ahead of the link, and how fast it turns. What the spring passes on is
linear in the mean rate of the link over a step, with which the rates of all joints are then solved for.
"""

from math import inf, pi, sqrt

from wipx.core.effect import Contains, Effect, FittedEffect
from wipx.core.law import law, maximum
from wipx.core.parameters import Parameter


def _swings_unseen(fitted: FittedEffect) -> bool:
    """Whether the drive swings faster than half the rate of the log, which then shows nothing but its inertia."""
    inertia = fitted.values["drive_inertia"]
    pulsation = sqrt(fitted.values["stiffness"] / inertia) if inertia > 0.0 else inf
    return pulsation > pi * fitted.rate


EFFECT = Effect(
    kind="elasticity",
    words="elasticity of {place}",
    sites=("drive",),
    parameters=(
        Parameter("drive_inertia", "of the drive, at the joint", "inertia", 0.0, 0.0, 10.0, 0.5),
        Parameter("stiffness", "of the spring", "stiffness", 1e3, 0.1, 1e5, 30.0),
        Parameter("damping", "of the spring", "damping", 0.0, 0.0, 30.0, 0.2),
    ),
    law="k d + c d', d = drive - link, J drive'' = F - k d - c d'",
    source="Spong 1987, Modeling and control of elastic joint robots, ASME JDSMC 109(4)",
    rows={"ELASTIC_INERTIA": "drive_inertia", "ELASTIC_STIFFNESS": "stiffness", "ELASTIC_DAMPING": "damping"},
    parts=("ELASTICITY", "DAMPING"),
    scan="springs",
    excludes=("backlash",),
    contains=Contains("rotor_inertia", when=_swings_unseen, symbols={"drive_inertia": "J"}, at_joint=True),
)

LEAST = 1e-300  # stands for nothing in a denominator


@law
def passed_on(force, twist, rate, stiffness, damping, inertia, step):
    """What the spring passes on to the link in a step, as a line over the mean rate of the link.

    Args:
        force: Of the motor on the drive [N or N m].
        twist: Drive ahead of the link at the beginning [m or rad].
        rate: Of the drive at the beginning [m/s or rad/s].
        stiffness: Of the spring [N/m or N m/rad].
        damping: Of the spring [N s/m or N m s/rad].
        inertia: Of the drive [kg or kg m^2].
        step: Length of the step [s].

    Returns:
        Mean force on a link that stands still [N or N m], and how much less it is per rate of the link.
    """
    resistance = 0.5 * step * stiffness + damping
    share = inertia / maximum(inertia + 0.5 * step * resistance, LEAST)
    return share * (stiffness * twist + resistance * rate) + (1.0 - share) * force, share * resistance


@law
def moved(force, twist, rate, link_rate, stiffness, damping, inertia, step):
    """Twist and rate of the drive at the end of a step, by the midpoint rule.

    Args:
        force: Of the motor on the drive [N or N m].
        twist: Drive ahead of the link at the beginning [m or rad].
        rate: Of the drive at the beginning [m/s or rad/s].
        link_rate: Mean rate of the link over the step [m/s or rad/s].
        stiffness: Of the spring [N/m or N m/rad].
        damping: Of the spring [N s/m or N m s/rad].
        inertia: Of the drive [kg or kg m^2].
        step: Length of the step [s].
    """
    half = 0.5 * step
    whole = maximum(inertia + half * (half * stiffness + damping), LEAST)
    parting = (inertia * (rate - link_rate) + half * (force - stiffness * twist)) / whole  # mean rate of the twist
    return twist + step * parting, 2.0 * (parting + link_rate) - rate
