"""A payload that comes during each recording, at time t0."""

from wipx.core.effect import Contains, Effect, FittedEffect
from wipx.core.parameters import Parameter

AT_ONCE = 0.15  # [s] after the start of a recording, before which no motion tells when the payload came


def _is_there_at_once(fitted: FittedEffect) -> bool:
    return fitted.values["t0"] <= fitted.latest_start + AT_ONCE


EFFECT = Effect(
    kind="payload_event",
    words="payload that comes during the recording",
    sites=("geometry",),
    parameters=(
        Parameter("mass", "of the payload", "mass", 0.0, 0.0, 1.0, 0.05, grid=(0.05,)),
        Parameter("height", "above the wheel axis", "length", 1.0, 0.0, 4.0, 1.0, grid=(0.5, 1.5), signed=True),
        Parameter(
            "t0", "when it comes", "moment", 0.0, 0.0, 1.0, 0.5, grid=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
        ),
    ),
    law="`payload` from t = t0 of each recording on",
    linear_in=("mass",),
    source="Atkeson, An, Hollerbach 1986, Estimation of inertial parameters, IJRR 5(3)",
    needs=("body_mass",),
    rows={"EVENT_TIME": "t0"},
    parts=("EVENT",),
    begins="t0",
    contains=Contains("payload", when=_is_there_at_once),
)
