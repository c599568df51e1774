"""What a joint and its drive are made of, as records that the equations read.

Positions in the state, shape (ROWS, N): coordinates, rates, lags of the drives, bristles, free drives and their rates,
elements of a hysteresis.
"""

from math import inf

import numpy as np

Q, V, LAGGED, BENT, DRIVE, DRIVE_RATE, ELEMENT = range(7)
ELEMENTS = 3
ROWS = ELEMENT + ELEMENTS

_FIELDS = (
    # friction
    ("viscous", 0.0), ("drag", 0.0), ("kinetic", 0.0), ("static", 0.0), ("bump_speed", 1.0), ("one_sided", 0.0),
    ("spot_level", 0.0), ("spot_low", 0.0), ("spot_high", 0.0), ("per_motor", 0.0), ("per_load", 0.0),
    ("bristle_level", 0.0), ("bristle_stiffness", 0.0), ("bristle_damping", 0.0),
    # elements that slip one after the other, over ways up to this length
    ("hysteresis", 0.0), ("hysteresis_way", 1.0),
    ("armature", 0.0), ("spring", 0.0), ("spring_rest", 0.0),
    # drive: the loop of a servo, then the path of its force
    ("input_gain", 1.0), ("kp", 0.0), ("kd", 0.0), ("servo_limit", inf), ("servo_period", 0.0),
    ("delay", 0.0), ("offset", 0.0), ("dead_band", 0.0), ("gain", 1.0), ("force_limit", inf),
    ("stall", inf), ("free_speed", inf), ("lag", 0.0), ("ripple", 0.0), ("ripple_number", 0.0), ("ripple_phase", 0.0),
    # a drive of its own inertia behind play or a spring
    ("drive_inertia", 0.0), ("gap", 0.0), ("contact_stiffness", 0.0), ("contact_damping", 0.0), ("grease", 0.0),
    # sensor
    ("sensor_bias", 0.0), ("sensor_scale", 0.0), ("sensor_delay", 0.0),
)  # fmt: skip
JOINT = np.dtype(
    [("driven", np.int64), ("servo", np.int64), ("dry", np.int64), ("elastic", np.int64)]
    + [(name, np.float64) for name, _ in _FIELDS]
)
CABLE = np.dtype(
    [("first", np.int64), ("second", np.int64)]
    + [(name, np.float64) for name in ("first_arm", "second_arm", "stiffness", "damping", "slack")]
)


def joint_records(n: int) -> np.ndarray:
    """Records of n joints without anything, shape (n,) of `JOINT`."""
    records = np.zeros(n, JOINT)
    for name, value in _FIELDS:
        records[name] = value
    return records
