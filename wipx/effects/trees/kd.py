"""Damping of a position drive that differs from the believed one."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="kd",
    words="wrong damping of {place}",
    sites=("drive",),
    parameters=(Parameter("factor", "true over believed damping", "ratio", 1.0, 0.0, 5.0, 1.0, grid=(0.9, 1.1)),),
    law="F = kp (u - q) - factor kd v",
    linear_in=("factor",),
    source="Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics, ch. 8 (decentralized control)",
    rows={"SERVO_KD": "factor"},
    linear_at_rest="kd",
)
