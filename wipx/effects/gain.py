"""Actuator gain: a force constant that differs from the believed one."""

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(command, p, body):
    return (p["k"] - 1.0) * command


EFFECT = Effect(
    kind="gain",
    words="wrong gain of {place}",
    sites=("actuator",),
    parameters=(Parameter("k", "force per commanded force", "ratio", 1.0, 0.2, 5.0, 1.0, grid=(0.9, 1.1)),),
    law="F = k u",
    linear_in=("k",),
    source="torque-constant error, BAM documentation of DC motors, github.com/Rhoban/bam",
    steady=Steady("command", _steady, stage=2),
    rows={"GAIN": "k"},
    linear_at_rest="gain",
    built_in="gear",
)
