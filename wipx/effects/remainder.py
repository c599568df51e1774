"""A force, gain or dry friction that no physics is known for: piecewise linear over one signal.

It stands in for what a diagnosis cannot name. Its curve is drawn from a Gaussian process prior in
`wipx.diagnosis.residuals.discrepancy`; here it is only evaluated.
"""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect
from wipx.core.parameters import Parameter

KNOTS = 9
COORDINATES, RATES, COMMANDS, TIME = (0, 1), (2, 3), (4, 5), 6  # codes of the signals, by joint
HIGHEST = 1e9

EFFECT = Effect(
    kind="remainder",
    words="force of unknown origin on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("signal", "0, 1 coordinates, 2, 3 rates, 4, 5 commands, 6 time", "ratio", 0.0, 0.0, 6.0, 0.0),
        Parameter("factor", "0: a force, 1: share of the command, -1: dry friction", "ratio", 0.0, -1.0, 1.0, 0.0),
        Parameter("low", "first knot, in the unit of the signal", "ratio", 0.0, -HIGHEST, HIGHEST, 0.0),
        Parameter("high", "last knot", "ratio", 1.0, -HIGHEST, HIGHEST, 1.0),
        *(Parameter(f"f{i}", f"force at knot {i}", "force", 0.0, -2.0, 2.0, 0.0) for i in range(KNOTS)),
    ),
    law="+ f(signal), + f(signal) u or - f(signal) sign(v), piecewise linear between nine knots",
    linear_in=tuple(f"f{i}" for i in range(KNOTS)),
    source="Rasmussen, Williams 2006, Gaussian Processes for Machine Learning, ch. 2",
    outside_vocabulary=True,
    rows={
        "REMAINDER_SIGNAL": "signal",
        "REMAINDER_FACTOR": "factor",
        "REMAINDER_LOW": "low",
        "REMAINDER_PER_UNIT": lambda p, body: (KNOTS - 1) / np.maximum(p["high"] - p["low"], 1e-12),
        "REMAINDER": lambda p, body: np.array([p[f"f{i}"] for i in range(KNOTS)]),
    },
    parts=lambda p: ("REMAINDER", "FRICTION") if np.any(p["factor"] < 0.0) else ("REMAINDER",),
)
