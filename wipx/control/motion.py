"""One step of a state estimate: the mean by the equations of motion, the covariance by their slopes; compiled.

The equations are those of contract section 2 with the smooth part of the model's effects: input gain, offset, dead
zone, gain and saturation on the path of the command, friction that builds up over a small speed in place of sticking
and of bristles, tilt, spring. Lags, backlash, ripple, the lag of the paper's friction and payload events are left
out: an estimator that sees the sensors every 1.5 ms takes what little they do in that time for process noise.
"""

import math

import numpy as np
from numba import boolean, float64

from wipx.core.law import clip, inlined, law, sin_cos
from wipx.effects import dead_zone, quadratic_drag, stribeck
from wipx.sim import body as B
from wipx.sim import rows as R
from wipx.sim.cache import cached_for, floats

LONGEST = 2e-3  # [s] of a step; the midpoint rule then errs by 1e-7 of the pitch of a body that falls at 7 1/s
REACH = 1e-5  # [m, rad, m/s, rad/s] of central differences; far below the speeds over which friction builds up


@law
def drive_force(command, c):
    """Force of a drive with coefficients c (BLOCK,) for a command that has arrived [N or N m]."""
    u = dead_zone.force(command * c[R.INPUT_GAIN] + c[R.OFFSET], c[R.DEAD_BAND], 0.0)
    return clip(u * c[R.GAIN], -c[R.FORCE_MAX], c[R.FORCE_MAX])


@law
def friction(rate, c, ease):
    """Friction on a joint with coefficients c (BLOCK,) [N or N m]; dry friction builds up over the speed `ease`."""
    level = c[R.LEVEL_PLUS] if rate > 0.0 else c[R.LEVEL_MINUS]
    level += stribeck.bump(rate, c[R.STATIC], c[R.COULOMB], c[R.STRIBECK_SPEED])
    level += c[R.SLIDING] + stribeck.bump(rate, c[R.PEAK], c[R.SLIDING], c[R.PEAK_SPEED])
    level += c[R.PAPER_COULOMB] + stribeck.bump(rate, c[R.PAPER_STATIC], c[R.PAPER_COULOMB], c[R.PAPER_SPEED])
    viscous = c[R.VISCOUS] + c[R.PAPER_VISCOUS]
    return quadratic_drag.force(rate, c[R.DRAG]) - level * math.tanh(rate / ease) - viscous * rate


@law
def inverse_mass(y, c, joints, double):
    """The symmetric inverse of the mass matrix, as its entries 11, 12, 22."""
    if double:
        _, cosine = sin_cos(y[1])
        elbow = c[B.DP_ELBOW] + c[B.DP_COUPLING] * cosine
        m11 = c[B.DP_BASE] + 2.0 * c[B.DP_COUPLING] * cosine + joints[0, R.ROTOR]
        m12, m22 = elbow, c[B.DP_ELBOW] + joints[1, R.ROTOR]
    else:
        _, cosine = sin_cos(y[1] - c[B.BALANCE] - c[B.TILT])
        m11, m12, m22 = c[B.MASS], -c[B.COUPLING] * cosine, c[B.INERTIA]
    determinant = m11 * m22 - m12 * m12
    return m22 / determinant, -m12 / determinant, m11 / determinant


@inlined
def slopes(y, commands, c, joints, double, ease):
    """Rates and accelerations of both joints at the state y = [coordinates, rates]."""
    first, second = joints[0], joints[1]
    force = drive_force(commands[0], first) + friction(y[2], first, ease[0])
    force1 = drive_force(commands[1], second) + friction(y[3], second, ease[1])
    if double:
        sine, _ = sin_cos(y[1])
        sine1, _ = sin_cos(y[0])
        sine12, _ = sin_cos(y[0] + y[1])
        coupling, lower = c[B.DP_COUPLING] * sine, c[B.DP_GRAVITY] * sine12
        force += coupling * (2.0 * y[2] + y[3]) * y[3] - c[B.DP_GRAVITY1] * sine1 - lower
        force1 -= coupling * y[2] * y[2] + lower
    else:
        upright = y[1] - c[B.BALANCE]
        sine, _ = sin_cos(upright)
        sine_to_rail, _ = sin_cos(upright - c[B.TILT])
        force -= c[B.COUPLING] * sine_to_rail * y[3] * y[3] + c[B.TILT_FORCE]
        force -= first[R.SPRING] * (y[0] - first[R.SPRING_REST])
        force1 += c[B.GRAVITY] * sine
    w11, w12, w22 = inverse_mass(y, c, joints, double)
    return np.array([y[2], y[3], w11 * force + w12 * force1, w12 * force + w22 * force1])


@inlined
def moved(y, commands, step, c, joints, double, ease):
    """The state after a `step`, by the midpoint rule."""
    middle = y + 0.5 * step * slopes(y, commands, c, joints, double, ease)
    return y + step * slopes(middle, commands, c, joints, double, ease)


@inlined
def spread(y, step, density, c, joints, double):
    """Covariance that white forces of a spectral `density` (2,) [N^2 s] add in a `step`, shape (4, 4)."""
    w11, w12, w22 = inverse_mass(y, c, joints, double)
    added = np.zeros((4, 4))
    accelerations = (
        (w11 * w11 * density[0] + w12 * w12 * density[1], w12 * (w11 * density[0] + w22 * density[1])),
        (w12 * (w11 * density[0] + w22 * density[1]), w12 * w12 * density[0] + w22 * w22 * density[1]),
    )
    for i in range(2):
        for j in range(2):
            a = accelerations[i][j]
            added[2 + i, 2 + j] = a * step
            added[i, 2 + j] = added[2 + i, j] = 0.5 * a * step**2
            added[i, j] = a * step**3 / 3.0
    return added


@cached_for(floats(1), floats(2), floats(1), float64, floats(1), floats(2), boolean, floats(1), floats(1))
def propagate(y, covariance, commands, duration, c, joints, double, ease, density):
    """State and covariance after a `duration` under held commands.

    Args:
        y: Coordinates, then rates, of both joints, shape (4,); those of a joint that the plant lacks are zero.
        covariance: Shape (4, 4).
        commands: On both joints, after the delay, shape (2,) [N or N m].
        duration: Any length [s].
        c: Numbers of the rigid body, shape (rows,).
        joints: Coefficients of the joints, shape (2, BLOCK).
        double: Whether it is a double pendulum.
        ease: Speed over which dry friction builds up, shape (2,) [m/s or rad/s].
        density: Spectral density of unknown forces on the joints, shape (2,) [N^2 s or (N m)^2 s].

    Returns:
        The same two, later.
    """
    pieces = max(1, math.ceil(duration / LONGEST - 1e-9))
    step = duration / pieces
    jacobian = np.empty((4, 4))
    for _ in range(pieces):
        for i in range(4):
            ahead, behind = y.copy(), y.copy()
            ahead[i] += REACH
            behind[i] -= REACH
            difference = moved(ahead, commands, step, c, joints, double, ease) - moved(
                behind, commands, step, c, joints, double, ease
            )
            jacobian[:, i] = difference / (2.0 * REACH)
        covariance = jacobian @ covariance @ jacobian.T + spread(y, step, density, c, joints, double)
        covariance = 0.5 * (covariance + covariance.T)  # of round-off, an asymmetry would grow without end
        y = moved(y, commands, step, c, joints, double, ease)
    return y, covariance


@cached_for(floats(1), floats(2), floats(1), floats(1), floats(1), floats(1))
def correct(y, covariance, measured, scale, offset, variance):
    """State and covariance after a reading of independent channels, one after the other.

    Args:
        y: Shape (4,).
        covariance: Shape (4, 4).
        measured: Of every state; NaN where nothing new was read, shape (4,).
        scale: A channel shows scale times its state plus offset, shape (4,).
        offset: See there, shape (4,).
        variance: Of the noise of each channel, shape (4,).

    Returns:
        State, covariance, innovations (4,), each given the channels before it and NaN where nothing was read, and
        their variances (4,).
    """
    innovations, variances = np.full(4, np.nan), np.full(4, np.nan)
    for i in range(4):
        if np.isnan(measured[i]):
            continue
        innovations[i] = measured[i] - scale[i] * y[i] - offset[i]
        variances[i] = scale[i] * scale[i] * covariance[i, i] + variance[i]
        gain = covariance[:, i] * (scale[i] / variances[i])
        y = y + gain * innovations[i]
        covariance = covariance - variances[i] * np.outer(gain, gain)
    return y, covariance, innovations, variances
