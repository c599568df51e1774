"""A sticky spot: extra Coulomb friction on a stretch of the rail."""

from wipx.core.effect import Effect
from wipx.core.law import law, maximum, minimum
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="sticky_spot",
    sites=("translation",),
    parameters=(
        Parameter("F_c", "extra level", "force", 0.0, 0.0, 1.0, 0.05),
        Parameter("lo", "where it begins", "coordinate", 0.0, -1.0, 1.0, -0.1),
        Parameter("hi", "where it ends", "coordinate", 0.0, -1.0, 1.0, 0.1),
    ),
    law="-F_c s(v) for lo <= x <= hi",
    linear_in=("F_c",),
    source="Popovic, Goldenberg 1998, Modeling of friction using spectral analysis, IEEE TRA 14(1)",
)


@law
def share(x_from, x_to, lo, hi):
    """Share of the way from `x_from` to `x_to` that lies in [lo, hi]; 0 or 1 at rest."""
    left = minimum(x_from, x_to)
    length = maximum(maximum(x_from, x_to) - left, 1e-9)
    return maximum(minimum(left + length, hi) - maximum(left, lo), 0.0) / length
