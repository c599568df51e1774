"""A sticky spot: extra Coulomb friction on a stretch of the rail."""

import numpy as np

from wipx.core.effect import Contains, Effect, FittedEffect
from wipx.core.law import law, maximum, minimum
from wipx.core.parameters import Parameter

WHOLE_WAY = 0.9  # share of the rows from which a spot is the whole rail


def _is_the_whole_way(fitted: FittedEffect) -> bool:
    x, values = fitted.positions, fitted.values
    return bool(np.mean((x >= values["lo"]) & (x <= values["hi"])) > WHOLE_WAY)


EFFECT = Effect(
    kind="sticky_spot",
    words="sticky spot on {place}",
    sites=("translation", "joint"),
    parameters=(
        Parameter("F_c", "extra level", "force", 0.0, 0.0, 1.0, 0.05),
        Parameter("lo", "where it begins", "coordinate", 0.0, -1.0, 1.0, -0.1),
        Parameter("hi", "where it ends", "coordinate", 0.0, -1.0, 1.0, 0.1),
    ),
    law="-F_c s(v) for lo <= x <= hi",
    linear_in=("F_c",),
    source="Popovic, Goldenberg 1998, Modeling of friction using spectral analysis, IEEE TRA 14(1)",
    rows={"SPOT": "F_c", "SPOT_LOW": "lo", "SPOT_HIGH": "hi"},
    parts=("SPOT", "FRICTION"),
    stretch=("lo", "hi"),
    scan="stretches",
    contains=Contains("coulomb", when=_is_the_whole_way),
)


@law
def share(x_from, x_to, lo, hi):
    """Share of the way from `x_from` to `x_to` that lies in [lo, hi]; 0 or 1 at rest."""
    left = minimum(x_from, x_to)
    length = maximum(maximum(x_from, x_to) - left, 1e-9)
    return maximum(minimum(left + length, hi) - maximum(left, lo), 0.0) / length
