"""The rigid body as functions of signals: contract section 2, in numpy, for any accelerations."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.sim import body as B
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients


@dataclass(frozen=True)
class RigidBody:
    """The rigid body of a model; geometry effects and a tilted rail are part of it.

    Attributes:
        model: The model.
    """

    model: Model

    @cached_property
    def _rows(self) -> np.ndarray:
        return coefficients(ModelBatch(self.model)).body[:, 0]

    @cached_property
    def _rotors(self) -> np.ndarray:
        return coefficients(ModelBatch(self.model)).joints[:, R.ROTOR, 0]

    def forces(self, t: np.ndarray, q: np.ndarray, rates: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """M(q) q'' + c + g, shape (N, joints) [N or N m].

        Args:
            t: Time, shape (N,) [s]; a payload may come.
            q: Coordinates, shape (N, joints).
            rates: Likewise.
            accelerations: Likewise.
        """
        inertial = np.einsum("nij,nj->ni", self.mass_matrix(t, q), accelerations)
        return inertial + (self._double_bias(q, rates) if self._is_double else self._bias(t, q, rates))

    def mass_matrix(self, t: np.ndarray, q: np.ndarray) -> np.ndarray:
        """M(q), shape (N, joints, joints) [kg, kg m, kg m^2]."""
        if self._is_double:
            return self._double_mass_matrix(q)
        rows, joints = self._rows, self.model.plant.joints
        after = self._after_event(t)
        matrix = np.zeros((len(q), len(joints), len(joints)))
        x, p = (joints.index(site) if site in joints else None for site in ("translation", "pitch"))
        if x is not None:
            matrix[:, x, x] = rows[B.MASS] + after * rows[B.EVENT_MASS]
        if p is not None:
            matrix[:, p, p] = rows[B.INERTIA] + after * rows[B.EVENT_INERTIA]
        if x is not None and p is not None:
            coupling = rows[B.COUPLING] + after * rows[B.EVENT_COUPLING]
            matrix[:, x, p] = matrix[:, p, x] = -coupling * np.cos(q[:, p] - rows[B.BALANCE] - rows[B.TILT])
        return matrix

    def _bias(self, t: np.ndarray, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
        rows, joints = self._rows, self.model.plant.joints
        after = self._after_event(t)
        forces = np.zeros_like(q)
        x, p = (joints.index(site) if site in joints else None for site in ("translation", "pitch"))
        if x is not None:
            forces[:, x] = rows[B.TILT_FORCE] + after * rows[B.EVENT_WEIGHT]
        if p is not None:
            upright = q[:, p] - rows[B.BALANCE]
            forces[:, p] = -(rows[B.GRAVITY] + after * rows[B.EVENT_GRAVITY]) * np.sin(upright)
            if x is not None:
                coupling = rows[B.COUPLING] + after * rows[B.EVENT_COUPLING]
                forces[:, x] += coupling * np.sin(upright - rows[B.TILT]) * rates[:, p] ** 2
        return forces

    def _after_event(self, t: np.ndarray) -> np.ndarray:
        """1 from the moment of a payload event on, 0 before and without one, shape (N,)."""
        if "geometry/payload_event" not in self.model.effects:
            return np.zeros(len(t))
        return (t >= self._rows[B.EVENT_TIME]).astype(float)

    @property
    def _is_double(self) -> bool:
        return self.model.plant.kind == "double_pendulum"

    def _double_mass_matrix(self, q: np.ndarray) -> np.ndarray:
        rows = self._rows
        elbow, c2 = rows[B.DP_ELBOW], np.cos(q[:, 1])
        matrix = np.empty((len(q), 2, 2))
        matrix[:, 0, 0] = rows[B.DP_BASE] + 2.0 * rows[B.DP_COUPLING] * c2 + self._rotors[0]
        matrix[:, 0, 1] = matrix[:, 1, 0] = elbow + rows[B.DP_COUPLING] * c2
        matrix[:, 1, 1] = elbow + self._rotors[1]
        return matrix

    def _double_bias(self, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
        rows = self._rows
        coriolis = rows[B.DP_COUPLING] * np.sin(q[:, 1])
        v1, v2 = rates.T
        lower = rows[B.DP_GRAVITY] * np.sin(q[:, 0] + q[:, 1])
        upper = rows[B.DP_GRAVITY1] * np.sin(q[:, 0])
        return np.column_stack([upper + lower - coriolis * (2.0 * v1 + v2) * v2, lower + coriolis * v1**2])
