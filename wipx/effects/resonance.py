"""A resonance: something swings along with a joint, such as a sloshing payload or a flexible pole."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect
from wipx.core.parameters import Parameter


def _pulsation(frequency):
    return 2.0 * np.pi * frequency


EFFECT = Effect(
    kind="resonance",
    words="resonance (something swings along) on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("m", "what swings, at the joint", "inertia", 0.0, 0.0, 10.0, 0.1, grid=(0.1,)),
        Parameter(
            "f",
            "frequency [Hz]",
            "ratio",
            1.0,
            0.2,
            30.0,
            2.0,
            grid=(0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0),
        ),
        Parameter("zeta", "damping ratio", "ratio", 0.05, 1e-3, 1.0, 0.05, grid=(0.05,)),
    ),
    law="+ m (w^2 y + 2 zeta w y'), y'' = -q'' - w^2 y - 2 zeta w y', w = 2 pi f",
    linear_in=("m",),
    source="Ibrahim 2005, Liquid Sloshing Dynamics, ch. 5 (equivalent mechanical models)",
    outside_vocabulary=True,
    rows={
        "SWING": "m",
        "SWING_STIFFNESS": lambda p, body: _pulsation(p["f"]) ** 2,
        "SWING_DAMPING": lambda p, body: 2.0 * p["zeta"] * _pulsation(p["f"]),
    },
    parts=("SWING",),
)
