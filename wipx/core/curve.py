"""A law as a person reads it: a curve over one signal, with what the recordings say of it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Curve:
    """A force over one signal, with what the recordings themselves say of it.

    Attributes:
        quantity: What the ordinate shows, in a word or two, e.g. "torque".
        signal: Column or rate on the abscissa, e.g. "x_dot".
        signal_unit: Its SI unit.
        force_unit: SI unit of the ordinate.
        at: Abscissa of the law, shape (N,).
        law: The law there, shape (N,) [force_unit].
        bins: Abscissa of the data's own estimate, shape (B,).
        force: Force that the recordings need beside the rest of the model, mean of each bin, shape (B,).
        spread: Standard error of each mean, shape (B,).
    """

    quantity: str
    signal: str
    signal_unit: str
    force_unit: str
    at: np.ndarray
    law: np.ndarray
    bins: np.ndarray
    force: np.ndarray
    spread: np.ndarray
