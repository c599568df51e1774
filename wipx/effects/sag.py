"""Sagging drive: it gives less when its battery empties or its magnets warm, and less where much is asked."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="sag",
    words="sag of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter("d", "share of the force that is lost per second", "per_time", 0.0, -0.05, 0.05, 0.0),
        Parameter("l", "share of the force that is lost per force", "per_load", 0.0, -0.5, 0.5, 0.0),
        Parameter("t_0", "time at which nothing is lost", "moment", 0.0, 0.0, 1.0, 0.5),
        Parameter("u_0", "force at which nothing is lost", "load", 0.0, 0.0, 2.0, 1.0),
    ),
    law="F = u (1 - d (t - t_0) - l (abs(u) - u_0))",
    linear_in=("d", "l"),
    source="Krishnan 2010, Permanent Magnet Synchronous and Brushless DC Motor Drives, ch. 1",
    outside_vocabulary=True,
    tolerance={"d": 0.005, "l": 0.1},
    rows={
        "SAG_TIME": "d",
        "SAG_LOAD": "l",
        "SAG_NONE": lambda p, body: p["d"] * p["t_0"] + p["l"] * p["u_0"],
    },
    parts=("SAG",),
)
