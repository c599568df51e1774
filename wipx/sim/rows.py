"""Names of the rows that the compiled simulator computes with.

One rollout is one column ("lane"). A pair of rows `X, X1` belongs to joints 0 and 1 (or to
the commands that act on them). A name in the lists below gets the next number; the last of a list counts them.
"""

from wipx.effects.remainder import KNOTS

MOST = 1000  # rows that a list has numbers for

W = 64  # lanes that a block has room for
TOGETHER = 16  # lanes that the compiler computes at once; blocks are filled up to a multiple of it

# Coefficients of a model, constant during a rollout (filled by `coefficients`).
(
    MASS, COUPLING, INERTIA, GRAVITY,  # wip family: M11, m_b L, M22, m_b g L
    DP_BASE, DP_ELBOW, DP_COUPLING, DP_GRAVITY, DP_GRAVITY1,  # double pendulum
    EVENT_MASS, EVENT_COUPLING, EVENT_INERTIA, EVENT_GRAVITY, EVENT_WEIGHT, EVENT_TIME,
    ROTOR, ROTOR1,
    BALANCE, TILT, TILT_FORCE, SPRING, SPRING_REST,
    INPUT_GAIN, DELAY, OFFSET, DEAD_BAND, GAIN, FORCE_MAX, STALL, FREE_SPEED, BACK_EMF, LAG_RATE,
    RIPPLE, RIPPLE_PERIODS, RIPPLE_PHASE, GAP, DRIVE_INERTIA, DRIVE_DAMPING, RETURNED, CONTACT_RATE,
    VISCOUS, VISCOUS1, DRAG, DRAG1,
    LEVEL_PLUS, LEVEL_PLUS1, LEVEL_MINUS, LEVEL_MINUS1,
    STATIC, STATIC1, COULOMB, COULOMB1, STRIBECK_SPEED, STRIBECK_SPEED1,
    SPOT, SPOT_LOW, SPOT_HIGH,
    LOAD_MOTOR, LOAD_MOTOR1, LOAD_EXTERNAL, LOAD_EXTERNAL1,
    BRISTLE, BRISTLE1, BRISTLE_DAMPING, BRISTLE_DAMPING1, SLIDING, SLIDING1, PEAK, PEAK1, PEAK_SPEED, PEAK_SPEED1,
    EXPONENT, EXPONENT1, GAMMA, GAMMA1,  # of hysteresis
    PAPER_STATIC, PAPER_STATIC1, PAPER_COULOMB, PAPER_COULOMB1, PAPER_SPEED, PAPER_SPEED1,
    PAPER_VISCOUS, PAPER_VISCOUS1, PAPER_EPSILON, PAPER_EPSILON1, PAPER_RATE, PAPER_RATE1,
    REMAINDER_SIGNAL, REMAINDER_SIGNAL1, REMAINDER_FACTOR, REMAINDER_FACTOR1, REMAINDER_LOW, REMAINDER_LOW1,
    REMAINDER_PER_UNIT, REMAINDER_PER_UNIT1, REMAINDER, REMAINDER1,  # the first knot of each joint, then the others
    *_,
) = range(MOST)  # fmt: skip
(
    SWING, SWING1, SWING_STIFFNESS, SWING_STIFFNESS1, SWING_DAMPING, SWING_DAMPING1,  # per mass
    SMOOTHING, SMOOTHING1,  # speed over which dry friction builds up, 0 for sticking
    BIAS, BIAS1, SCALE, SCALE1, SENSOR_DELAY, SENSOR_DELAY1,
    N_COEFFICIENTS, *_,
) = range(REMAINDER + 2 * KNOTS, MOST)  # fmt: skip

# State of a rollout, carried from step to step.
(
    Q, Q1, V, V1,  # coordinates and rates
    ACCELERATION, ACCELERATION1,  # of the last step, predicts the rate in mid-step
    Z, Z1,  # bristles
    PAPER, PAPER1,  # lagged friction
    LAGGED, LAGGED1,  # actuator
    PLACE, PLACE1, DRIVE_SPEED, DRIVE_SPEED1, PASSED, PASSED1,  # backlash
    MADE, MADE1, LIGHTNESS, LIGHTNESS1,  # accelerations in the last step: by the drive, and by a force of one
    SWING_PLACE, SWING_PLACE1, SWING_RATE, SWING_RATE1,
    EXTRA, EXTRA1,  # accelerations that an observer adds
    STARTED,  # 0 before the first step, then 1
    N_STATES, *_,
) = range(N_COEFFICIENTS, MOST)  # fmt: skip

# Scratch of one step.
(
    STEP, PER_STEP, ROW_STEP, TIME,
    LAG_KEPT, LAG_MEAN, CONTACT_KEPT, CONTACT_MEAN,
    PAPER_KEPT, PAPER_KEPT1, PAPER_MEAN, PAPER_MEAN1,  # of lags over one step
    MID, MID1, RATE, RATE1,  # coordinates and rates in mid-step
    COMMAND, COMMAND1, DRIVE, DRIVE1,  # command now, and the force that comes of it
    SPREAD, SPREAD1,  # half width of the single commands about their mean
    RAMP, RAMP1, PHASE, PER_ROW,  # change of the command along the row, place in the row, one over its steps
    DELIVERED, DELIVERED1,  # integral of the drive's force over the row
    M11, M12, M22, COUPLING_NOW, GRAVITY_NOW,
    W11, W12, W22, YIELD, YIELD1, NEXT, NEXT1,  # inverse of the mass matrix, rates at the end
    FORCE, FORCE1, DAMPING, DAMPING1, PLUS, PLUS1, MINUS, MINUS1,
    BRISTLE_KEPT, BRISTLE_KEPT1, BRISTLE_GAIN, BRISTLE_GAIN1, YIELDING, YIELDING1,
    SHOWN, SHOWN1,  # coordinates as the sensors show them
    MEASURED, MEASURED1, MEASURED_RATE, MEASURED_RATE1,  # what the controller works with
    NOISE, NOISE1, NOISE_RATE, NOISE_RATE1,
    REFERENCE, REFERENCE1, REFERENCE_RATE, REFERENCE_RATE1,
    N_ROWS, *_,
) = range(N_STATES, MOST)  # fmt: skip

STATES = N_STATES - N_COEFFICIENTS  # rows of a carried state

# Which parts of the signal path are present, uniform over a batch.
(
    ON_DOUBLE, ON_EVENT, ON_TILT, ON_SPRING,
    ON_DELAY, ON_OFFSET, ON_DEAD_ZONE, ON_SATURATION, ON_SPEED_LIMIT, ON_BACK_EMF, ON_LAG, ON_RIPPLE, ON_BACKLASH,
    ON_DAMPING, ON_DRAG, ON_DRAG1, ON_FRICTION, ON_STRIBECK, ON_STRIBECK1, ON_SPOT, ON_LOAD, ON_LOAD1,
    ON_BRISTLE, ON_BRISTLE1, ON_HYSTERESIS, ON_HYSTERESIS1, ON_PAPER, ON_PAPER1, ON_SENSOR_DELAY, ON_SMOOTHING,
    ON_RAMP, ON_REMAINDER, ON_REMAINDER1, ON_SWING, ON_SWING1, ON_REPORT,
    ON_ENGINE,  # moves the rigid body
    N_FLAGS, *_,
) = range(MOST)  # fmt: skip
