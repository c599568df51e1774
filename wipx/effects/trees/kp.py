"""Stiffness of a position drive that differs from the believed one."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="kp",
    words="wrong stiffness of {place}",
    sites=("drive",),
    parameters=(Parameter("factor", "true over believed stiffness", "ratio", 1.0, 0.2, 5.0, 1.0, grid=(0.9, 1.1)),),
    law="F = factor kp (u - q) - kd v",
    linear_in=("factor",),
    source="Siciliano, Sciavicco, Villani, Oriolo 2009, Robotics, ch. 8 (decentralized control)",
    rows={"SERVO_KP": "factor"},
    linear_at_rest="kp",
)
