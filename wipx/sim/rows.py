"""Names of the rows that the compiled simulator computes with.

One rollout is one column ("lane"). Each joint has a block of rows of its own, the same for all. The rows of the whole
robot are those below, then the lower triangle of the mass matrix, row by row, then the numbers of the rigid body, which
`wipx.sim.body` or the code written for a robot names.
"""

W = 64  # lanes that a block has room for
TOGETHER = 16  # lanes that the compiler computes at once; blocks are filled up to a multiple of it

# Of the whole robot.
(
    ROW_STEP,  # length of the steps of this row
    STEP, PER_STEP, TIME,  # of this step, zero for a lane that is through with its row; one over it; its beginning
    PHASE, PER_ROW,  # place in the row, one over its steps
    CROSS,  # entry 12 of the inverse mass matrix of two joints
    COMMON,
    *_,
) = range(100)  # fmt: skip

# Of a joint. First what is carried from step to step.
(
    Q, V,  # coordinate and rate
    ACCELERATION,  # of the last step, predicts the rate in mid-step
    Z,  # bristle
    PAPER,  # lagged friction
    LAGGED,  # actuator
    PLACE, DRIVE_SPEED, PASSED,  # backlash
    TWIST, DRIVE_RATE,  # of an elastic drive: how far it is ahead of its link, and how fast it turns
    MADE, LIGHTNESS,  # accelerations in the last step: by the drive, and by a force of one
    SWING_PLACE, SWING_RATE,
    EXTRA,  # acceleration that an observer adds
    SERVO_FORCE, SERVO_NEXT,  # what the loop of a position drive asks for, and when it looks again
    SIDE,  # to which dry friction acts: -1, 1, or 0 where it holds the joint
    STARTED,  # 0 before the first step, then 1
    STATES,
    *_,
) = range(100)  # fmt: skip

# Coefficients of a model, constant during a rollout.
(
    ROTOR, SPRING, SPRING_REST,
    SERVO_KP, SERVO_KD, SERVO_LIMIT, SERVO_PERIOD,
    INPUT_GAIN, DELAY, OFFSET, DEAD_BAND, SAG_TIME, SAG_MIDDLE, SAG_LOAD, SAG_USUAL, SAG_MOST,
    GAIN, FORCE_MAX, STALL, FREE_SPEED, BACK_EMF, LAG_RATE,
    RIPPLE, RIPPLE_PERIODS, RIPPLE_PHASE, GAP, DRIVE_INERTIA, DRIVE_DAMPING, RETURNED, CONTACT_RATE,
    ELASTIC_INERTIA, ELASTIC_STIFFNESS, ELASTIC_DAMPING,
    VISCOUS, DRAG, LEVEL_PLUS, LEVEL_MINUS, STATIC, COULOMB, STRIBECK_SPEED, SPOT, SPOT_LOW, SPOT_HIGH,
    LOAD_MOTOR, LOAD_EXTERNAL,
    BRISTLE, BRISTLE_DAMPING, SLIDING, PEAK, PEAK_SPEED, EXPONENT, GAMMA,  # the last two of hysteresis
    PAPER_STATIC, PAPER_COULOMB, PAPER_SPEED, PAPER_VISCOUS, PAPER_EPSILON, PAPER_RATE,
    REMAINDER_SIGNAL, REMAINDER_FACTOR, REMAINDER_LOW, REMAINDER_PER_UNIT,
    REMAINDER, _R1, _R2, _R3, _R4, _R5, _R6, _R7, _R8,  # knots
    SWING, SWING_STIFFNESS, SWING_DAMPING,  # per mass
    SMOOTHING,  # speed over which dry friction builds up, 0 for sticking
    BIAS, SCALE, SENSOR_DELAY, ECCENTRIC_SINE, ECCENTRIC_COSINE, ECCENTRIC_NUMBER,
    SPREAD,  # half width of the single commands about their mean
    _SCRATCH,
    *_,
) = range(STATES, 200)  # fmt: skip

# Scratch of one step.
(
    LAG_KEPT, LAG_MEAN, CONTACT_KEPT, CONTACT_MEAN, PAPER_KEPT, PAPER_MEAN,  # of lags over one step
    H, PER_H,  # step and one over it, as in the rows of the whole robot
    MID, RATE,  # coordinate and rate in mid-step
    COMMAND, DRIVE, RAMP,  # command now, the force that comes of it, and its change along the row
    MOTOR_FORCE, TAKEN_BACK,  # of an elastic drive: force on it, and by how much less its link gets per rate
    DELIVERED,  # integral of the drive's force over the row
    FORCE, DAMPING, PLUS, MINUS,  # on the joint; levels of dry friction against motion to either side
    INVERSE,  # own entry of the inverse of the mass matrix, with damping
    YIELD,  # rate that an impulse of one leaves a joint that sticks with: 0, or more where friction is smoothed
    NEXT,  # rate at the end of the step
    KEEP, HOLD, AIM, RIGHT, PUSHED,  # of the search for the joints that stick, see `wipx.sim.sticking`
    BRISTLE_KEPT, BRISTLE_GAIN, YIELDING,
    SHOWN,  # coordinate as the sensor shows it
    MEASURED, MEASURED_RATE,  # what the controller works with
    NOISE, NOISE_RATE, REFERENCE, REFERENCE_RATE,
    BLOCK,
    *_,
) = range(_SCRATCH, 200)  # fmt: skip

# Which parts of the signal path are present, uniform over a batch: for the whole robot,
(
    ON_TREE, ON_DOUBLE,  # robots from model files, double pendulum; else the wip family
    ON_EVENT, ON_TILT,
    ON_DELAY, ON_DAMPING, ON_FRICTION, ON_SMOOTHING,  # on any joint
    ON_TIME,  # where the time of a step counts
    ON_RAMP, ON_REPORT,
    ON_ENGINE,  # moves the rigid body
    FLAGS,
    *_,
) = range(100)  # fmt: skip
# and for each joint.
(
    ACTUATED,
    ON_PATH, ON_LAWS,  # any stage of the path through the drive; any law of friction beyond a level and damping
    ON_MEMORY,  # any part that must know whether it began
    ON_SERVO, ON_SPRING, ON_OFFSET, ON_DEAD_ZONE, ON_SAG, ON_GAIN, ON_SATURATION, ON_SPEED_LIMIT, ON_BACK_EMF, ON_LAG,
    ON_RIPPLE, ON_BACKLASH, ON_ELASTICITY, ON_SENSOR_DELAY, ON_ECCENTRICITY,
    ON_DRAG, ON_STRIBECK, ON_SPOT, ON_LOAD, ON_BRISTLE, ON_HYSTERESIS, ON_PAPER, ON_REMAINDER, ON_SWING,
    JOINT_FLAGS,
    *_,
) = range(FLAGS, 100)  # fmt: skip
PATH = (ON_SERVO, ON_OFFSET, ON_DEAD_ZONE, ON_SAG, ON_GAIN, ON_SATURATION, ON_SPEED_LIMIT, ON_BACK_EMF, ON_LAG)
PATH += (ON_RIPPLE, ON_BACKLASH, ON_ELASTICITY)
LAWS = (ON_DRAG, ON_STRIBECK, ON_SPOT, ON_LOAD, ON_BRISTLE, ON_PAPER, ON_REMAINDER, ON_SWING)
MEMORY = (ON_LAG, ON_BACKLASH, ON_ELASTICITY, ON_PAPER, ON_SERVO)

# What the code of a rigid body is asked for.
(
    FORCES,  # write the mass matrix and add to the forces on the joints
    SOLVE,  # rates from impulses, and
    MULTIPLY,  # impulses from rates, where there are more than two joints (`wipx.sim.sticking`)
) = range(3)
