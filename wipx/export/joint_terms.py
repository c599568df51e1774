"""What MuJoCo can say of the joints of a completed model: damping, dry friction, bristles, springs.

Dry friction is `frictionloss` with a constraint so stiff that the joint sticks. A Stribeck peak is a LuGre bristle of a
passive `dcmotor` actuator beside it, which holds only what the static level exceeds Coulomb's by. Bristle laws
(`presliding`, `lugre`) are that bristle itself. A force of one direction is a cogging torque without poles.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from wipx.core.export_result import Statement, approximated, exact, lost
from wipx.core.model import Model

STIFFEST = 0.3  # stiffness times squared step over inertia, up to which a bristle is stable
LIGHTLY = 0.03  # damping of such a bristle at the Stribeck velocity, of the peak; more would push where the level falls
SHARE = 0.01  # of a Stribeck peak that the bristle keeps at high speed, so that it never has a level of zero


@dataclass(frozen=True)
class Bristle:
    """LuGre friction: -(stiffness z + damping z'), z' = v - stiffness abs(v) z / g(v).

    Attributes:
        stiffness: [N m/rad or N/m].
        damping: [N m s/rad or N s/m].
        sliding: Level g at high speed [N m or N].
        peak: Level at rest.
        speed: Stribeck velocity [rad/s or m/s].
    """

    stiffness: float
    damping: float
    sliding: float
    peak: float
    speed: float


@dataclass(frozen=True)
class JointTerms:
    """Numbers of one joint.

    Attributes:
        damping: Coefficients of v and v abs(v).
        friction: Level of dry friction.
        stiffness: Of a spring.
        rest: Where it is relaxed.
        constant: Force that acts at all times.
        bristle: Friction with memory; None without.
        statements: What became of the joint's effects.
    """

    damping: tuple[float, float] = (0.0, 0.0)
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    constant: float = 0.0
    bristle: Bristle | None = None
    statements: tuple[Statement, ...] = ()


def joint_terms(model: Model, joint: str, inertia: float, step: float) -> JointTerms:
    """What MuJoCo can say of a joint.

    Args:
        model: The completed model.
        joint: Its name.
        inertia: That its drive feels at rest [kg m^2 or kg].
        step: Of MuJoCo's integrator [s].
    """
    terms = _Terms(inertia, step)
    terms.linear = model.parameters.get(f"{joint}.damping", 0.0)
    terms.friction = model.parameters.get(f"{joint}.friction", 0.0)
    first = model.plant.joints[0]
    for name, values in model.effects.items():
        site, _, kind = name.partition("/")
        if site == joint or (name == "environment/spring" and joint == first):
            say = _SAID.get(kind)
            said = lost(name, "MJCF has no such law") if say is None else say(terms, name, values)
            terms.statements.append(said)
    return JointTerms(
        (terms.linear, terms.quadratic),
        max(terms.friction, 0.0),
        terms.stiffness,
        terms.rest,
        terms.constant,
        terms.bristle,
        tuple(terms.statements),
    )


class _Terms:
    """Numbers while the effects of a joint are gone through."""

    def __init__(self, inertia: float, step: float) -> None:
        self.inertia = inertia
        self.stiffest = STIFFEST * inertia / step**2
        self.linear = self.quadratic = self.friction = self.constant = 0.0
        self.stiffness = self.rest = 0.0
        self.bristle: Bristle | None = None
        self.statements: list[Statement] = []

    def bent(self, name: str, bristle: Bristle, how: str) -> Statement:
        """Add a bristle, no stiffer than the step allows."""
        if bristle.stiffness <= self.stiffest:
            self.bristle = bristle
            return exact(name, how)
        damping = min(bristle.damping, (self.stiffest * self.inertia) ** 0.5)
        self.bristle = Bristle(self.stiffest, damping, bristle.sliding, bristle.peak, bristle.speed)
        return approximated(name, f"{how}, its stiffness lowered to {self.stiffest:.3g} for the step")

    def peak(self, static: float, coulomb: float, speed: float) -> None:
        """Dry friction with a level that falls as the speed rises."""
        more = max(static - coulomb, 0.0)
        self.friction += coulomb - SHARE * more
        if more > 0.0:
            self.bristle = Bristle(self.stiffest, LIGHTLY * more / speed, SHARE * more, more, speed)


Values = Mapping[str, float]


def _viscous(terms: _Terms, name: str, p: Values) -> Statement:
    terms.linear += p["sigma"]
    return exact(name, "damping of the joint")


def _drag(terms: _Terms, name: str, p: Values) -> Statement:
    terms.quadratic += p["c"]
    return exact(name, "second coefficient of the joint's damping")


def _coulomb(terms: _Terms, name: str, p: Values) -> Statement:
    terms.friction += p["F_c"]
    return exact(name, "frictionloss of the joint")


def _asymmetric(terms: _Terms, name: str, p: Values) -> Statement:
    terms.friction += 0.5 * (p["F_plus"] + p["F_minus"])
    terms.constant += 0.5 * (p["F_minus"] - p["F_plus"])
    return exact(name, "frictionloss of the joint and a constant force")


def _stribeck(terms: _Terms, name: str, p: Values) -> Statement:
    terms.peak(p["F_s"], p["F_c"], p["v_s"])
    return approximated(name, "frictionloss of the joint, and a LuGre bristle for what the static level exceeds it by")


def _presliding(terms: _Terms, name: str, p: Values) -> Statement:
    bristle = Bristle(p["stiffness"], p["damping"], p["F_c"], p["F_c"], 1.0)
    return terms.bent(name, bristle, "LuGre friction of a passive dcmotor")


def _lugre(terms: _Terms, name: str, p: Values) -> Statement:
    bristle = Bristle(p["stiffness"], p["damping"], p["F_c"], max(p["F_s"], p["F_c"]), p["v_s"])
    return terms.bent(name, bristle, "LuGre friction of a passive dcmotor")


def _hysteresis(terms: _Terms, name: str, p: Values) -> Statement:
    bristle = Bristle(p["stiffness"], p["damping"], p["F_c"], p["F_c"], 1.0)
    said = terms.bent(name, bristle, "LuGre friction of a passive dcmotor")
    return (
        said if p["n"] == 1.0 and p["gamma"] == 0.0 else approximated(name, f"{said.how}, without exponent and gamma")
    )


def _paper(terms: _Terms, name: str, p: Values) -> Statement:
    terms.peak(p["F_s"], p["F_c"], p["v_s"])
    terms.linear += p["sigma"]
    return approximated(name, "as stribeck and viscous, without the dead zone in speed and the lag")


def _spring(terms: _Terms, name: str, p: Values) -> Statement:
    stiffness, rest = p["k"], p["q0"] if "q0" in p else p["x0"]
    total = terms.stiffness + stiffness
    terms.rest = (terms.stiffness * terms.rest + stiffness * rest) / total if total else 0.0
    terms.stiffness = total
    return exact(name, "stiffness and springref of the joint")


def _rotor(terms: _Terms, name: str, p: Values) -> Statement:
    return exact(name, "armature of the joint")


_SAID = {
    "viscous": _viscous,
    "quadratic_drag": _drag,
    "coulomb": _coulomb,
    "asymmetric_coulomb": _asymmetric,
    "stribeck": _stribeck,
    "presliding": _presliding,
    "lugre": _lugre,
    "hysteresis": _hysteresis,
    "lagged_stribeck": _paper,
    "spring": _spring,
    "rotor_inertia": _rotor,
}
