"""What the sensors of a batch of models do to a coordinate, and the true states behind what they show."""

import numpy as np

from wipx.core.model import ModelBatch

ROUNDS = 3  # of the search for the angle that an eccentric encoder shows; each is better by the error's slope


def true_states(batch: ModelBatch, shown: np.ndarray) -> np.ndarray:
    """States behind what the sensors show: bias, scale and eccentricity are undone, delays are not.

    Args:
        batch: P models.
        shown: Coordinates, then rates as large as a sensor with its scale shows them, shape (..., 2 joints, P, R).
    """
    true = shown.copy()
    joints = shown.shape[-3] // 2
    coordinates = true[..., :joints, :, :]
    sine, cosine, number = (of_sensors(batch, "eccentricity", symbol)[..., None] for symbol in ("s", "c", "n"))
    if np.any(number):
        number = np.where(number, number, 1.0)
        for _ in range(ROUNDS):
            error = sine * np.sin(number * coordinates) + cosine * np.cos(number * coordinates)
            coordinates = shown[..., :joints, :, :] - error / number
    true[..., :joints, :, :] = coordinates - of_sensors(batch, "bias", "b")[..., None]
    return true / np.tile(scales_of(batch), (2, 1))[..., None]


def delays_of(batch: ModelBatch) -> np.ndarray:
    """Delay of each coordinate's sensor in each of P models, shape (joints, P) [s]."""
    return of_sensors(batch, "delay", "tau")


def scales_of(batch: ModelBatch) -> np.ndarray:
    """What the sensors of each of P models show of one unit, shape (joints, P)."""
    return 1.0 + of_sensors(batch, "scale", "e")


def of_sensors(batch: ModelBatch, kind: str, symbol: str) -> np.ndarray:
    """A number of each coordinate's sensor in each of P models, shape (joints, P); zero where it has none."""
    return np.stack([_column(batch, f"sensor_{name}/{kind}", symbol) for name in batch.model.plant.coordinates])


def _column(batch: ModelBatch, effect: str, symbol: str) -> np.ndarray:
    """A number of an effect in every model, shape (P,); zero where the effect is absent."""
    return batch.column(f"{effect}.{symbol}") if effect in batch.model.effects else np.zeros(batch.size)
