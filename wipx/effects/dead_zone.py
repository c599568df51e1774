"""Input dead zone: small commands produce no force."""

import numpy as np

from wipx.core.effect import Effect, Steady
from wipx.core.law import above, law
from wipx.core.parameters import Parameter


def _steady(command, p, body):
    return np.vectorize(force)(command, p["band"], 0.0) - command


EFFECT = Effect(
    kind="dead_zone",
    words="dead zone of {place}",
    sites=("actuator", "drive"),
    parameters=(Parameter("band", "half width", "force", 0.0, 0.0, 0.5, 0.02, grid=(0.01, 0.05, 0.2)),),
    law="0 for abs(u) < band, else u - band s(u)",
    linear_in=("band",),
    source="Tao, Kokotovic 1996, Adaptive control of systems with actuator and sensor nonlinearities",
    steady=Steady("command", _steady, stage=1),
    rows={"DEAD_BAND": "band"},
    parts=("DEAD_ZONE",),
)


@law
def force(u, band, spread):
    """Mean force of commands scattered by up to `spread` about `u`; spread 0 is the plain law."""
    return above(u - band, spread) - above(-u - band, spread)
