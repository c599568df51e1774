"""The paper's joint model (Eq. 5): Stribeck friction with a dead zone in speed, lagged.

How the printed equation was read:

- "0 for q' < epsilon" means |q'| < epsilon; as printed it would remove friction from all
  backward motion, and Fig. 3 of the paper is odd in the speed.
- "e^r = -(v/v_s)^2" means the exponent r = -(v/v_s)^2.
- g = -alpha F_ss(t) + (alpha - 1) F_ss(t-1) weighs the friction now by alpha and that of the
  previous sample by 1 - alpha, and opposes the motion. This is a mean delay of (1 - alpha)
  samples. Written for a fixed sample, its result would depend on the step of the integrator;
  here the same delay is a first-order lag of (1 - alpha)/650 s, the paper's loop running at
  600 to 700 Hz.

Unlike `stribeck` this law does not stick: below epsilon there is no friction.
"""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.law import decay, law, sign
from wipx.core.parameters import Parameter
from wipx.effects.lag import rate_of

SAMPLE_PERIOD = 1.0 / 650.0  # [s], paper Sec. IV: control loop of 600 to 700 Hz


def _steady(rate, p, body):
    return -np.vectorize(resistance)(rate, p["F_s"], p["F_c"], p["v_s"], p["sigma"], p["epsilon"])


EFFECT = Effect(
    kind="lagged_stribeck",
    words="lagged Stribeck friction on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_s", "static level", "force", 0.0, 0.0, 1.0, 0.03),
        Parameter("F_c", "Coulomb level", "force", 0.0, 0.0, 1.0, 0.02),
        Parameter("v_s", "Stribeck velocity", "velocity", 1.0, 2e-3, 1.0, 0.05),
        Parameter("sigma", "viscous coefficient", "damping", 0.0, 0.0, 3.0, 0.02),
        Parameter("epsilon", "speed below which there is no friction", "velocity", 0.0, 0.0, 0.1, 1e-3),
        Parameter("alpha", "share of the friction that acts at once", "ratio", 1.0, 0.05, 1.0, 1.0),
    ),
    law="-F_ss lagged by (1 - alpha)/650 s; F_ss = 0 for abs(v) < epsilon, "
    "else s(v) [F_c + (F_s - F_c) exp(-(v/v_s)^2)] + sigma v",
    source="Baek, Sim, Purushottam, Gupta, Ramos 2024, Eq. 5",
    excludes=("coulomb", "asymmetric_coulomb", "stribeck", "presliding", "lugre", "viscous"),
    outside_vocabulary=True,
    steady=Steady("rate", _steady),
    rows={
        "PAPER_STATIC": "F_s",
        "PAPER_COULOMB": "F_c",
        "PAPER_SPEED": "v_s",
        "PAPER_VISCOUS": "sigma",
        "PAPER_EPSILON": "epsilon",
        "PAPER_RATE": lambda p, body: rate_of(lag_of(p["alpha"])),
    },
    parts=("PAPER",),
    linear_at_rest="viscous",  # what a joint feels that moves beyond the dead zone
)


@law
def resistance(v, static, coulomb, v_s, sigma, epsilon):
    """Steady-state friction F_ss at velocity `v` [N or N m], positive against positive motion."""
    ratio = v / v_s
    sliding = sign(v) * (coulomb + (static - coulomb) * decay(ratio * ratio)) + sigma * v
    return sliding if abs(v) >= epsilon else 0.0


def lag_of(alpha):
    """Time constant of the lag that has the paper's mean delay of (1 - alpha) samples [s]."""
    return (1.0 - alpha) * SAMPLE_PERIOD
