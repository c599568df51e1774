"""Compilation of laws: small pure functions that kernels and per-step engines share.

The exponential and the sine are polynomials, because calls into the mathematics library keep
a loop over rollouts from being vectorised (five times slower, measured by `make bench`).
"""

from typing import Any

import numba
import numpy as np

# NaN and infinity stay meaningful: a rollout that fell over must be recognisable.
OPTIONS: dict[str, Any] = {"fastmath": {"nsz", "arcp", "contract", "afn", "reassoc"}, "error_model": "numpy"}

# Every function that a kernel calls is taken into it. Otherwise a kernel that has just been compiled would call another
# copy of the function than one that is read from the disk, and the two round differently.
TAKEN_IN: dict[str, Any] = {**OPTIONS, "forceinline": True, "no_cfunc_wrapper": True}
IN_PLACE: dict[str, Any] = {"_nrt": False}  # for what allocates nothing (`wipx.sim.cache.in_place`)
law = numba.njit(**TAKEN_IN, **IN_PLACE)  # by the compiler
inlined = numba.njit(**OPTIONS, inline="always")  # as source: loops over arrays compile three times faster so


@law
def minimum(a, b):
    """The smaller of two numbers, as a select."""
    return a if a < b else b


@law
def maximum(a, b):
    """The larger of two numbers, as a select."""
    return a if a > b else b


@law
def clip(value, low, high):
    """`value` limited to [low, high]."""
    return minimum(maximum(value, low), high)


@law
def above(excess, spread):
    """Mean of what is above zero of numbers about `excess`, triangularly distributed over +-`spread`."""
    tail = maximum(spread - abs(excess), 0.0)
    return maximum(excess, 0.0) + tail * tail * tail / (6.0 * maximum(spread * spread, 1e-24))


@law
def sign(value):
    """-1, 0 or 1."""
    return (1.0 if value > 0.0 else 0.0) - (1.0 if value < 0.0 else 0.0)


@law
def decay(y):
    """exp(-y) for y >= 0, relative error below 1e-11 up to y = 40, constant beyond.

    Taylor polynomial of exp(-y / 256), squared eight times.
    """
    z = minimum(y, 40.0) * (-1.0 / 256.0)
    p = 1 / 40320 + z / 362880
    p = 1 / 5040 + z * p
    p = 1 / 720 + z * p
    p = 1 / 120 + z * p
    p = 1 / 24 + z * p
    p = 1 / 6 + z * p
    p = 1 / 2 + z * p
    p = 1.0 + z * (1.0 + z * p)
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    p = p * p
    return p * p


@law
def relaxing(y):
    """exp(-y) and its mean (1 - exp(-y)) / y over one step, for y >= 0."""
    kept = decay(y)
    series = 1.0 - y * (1 / 2 - y * (1 / 6 - y * (1 / 24 - y * (1 / 120))))
    return kept, series if y < 0.02 else (1.0 - kept) / maximum(y, 1e-4)


@law
def turns(angle):
    """The whole number of turns nearest to an `angle` [rad], as a float."""
    return np.rint(angle * 0.15915494309189535)


@law
def sin_cos(angle):
    """Sine and cosine of any `angle` [rad], absolute error below 1e-12 for |angle| < 1e3.

    Reduced to half the angle in [-pi/2, pi/2], Taylor polynomials, double-angle formula.
    """
    k = turns(angle)
    half = 0.5 * ((angle - k * 6.283185307179586) - k * 2.4492935982947064e-16)
    z = half * half
    p = 1 / 1307674368000 - z / 355687428096000
    p = 1 / 6227020800 - z * p
    p = 1 / 39916800 - z * p
    p = 1 / 362880 - z * p
    p = 1 / 5040 - z * p
    p = 1 / 120 - z * p
    p = 1 / 6 - z * p
    sine = half * (1.0 - z * p)
    p = 1 / 20922789888000 - z / 6402373705728000
    p = 1 / 87178291200 - z * p
    p = 1 / 479001600 - z * p
    p = 1 / 3628800 - z * p
    p = 1 / 40320 - z * p
    p = 1 / 720 - z * p
    p = 1 / 24 - z * p
    cosine = 1.0 - z * (1 / 2 - z * p)
    return 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
