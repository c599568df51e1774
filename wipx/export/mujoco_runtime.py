"""The completed robot in MuJoCo, one step at a time: for reinforcement learning, controllers and viewers.

    from wipx.export.mujoco_runtime import Runtime

    robot = Runtime.open("runs/export/...")   # what task=export wrote
    robot.reset(q=[0.0, 0.3, 0.0])
    for _ in range(1000):
        robot.step(policy(robot.shown))       # commands, as in the columns u of the recordings
    robot.data                                # MuJoCo's own data

MuJoCo moves the bodies. Wipx's laws make the commands into forces in every step: delays, servos, dead zones, limits,
lags, backlash, elasticity, every law of friction with true sticking, and what the sensors show. The result is that of
`sim=mujoco`. A file into which the robot was put, with contacts and other bodies, may be given instead of the exported
one; sticking then does not know of contact forces until the step after.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.export.file_world import FileWorld, steps_within
from wipx.export.mjcf import mujoco_module
from wipx.recordings.model_file import read_model
from wipx.sim import rows as R
from wipx.sim.cache import settled
from wipx.sim.coefficients import coefficients
from wipx.sim.coupling import after, before, begin, between, show
from wipx.sim.exchange import Exchange
from wipx.sim.inputs import AFTER_THE_END, Inputs
from wipx.sim.kernel import filled
from wipx.sim.layout import Layout
from wipx.sim.rows import W

ROWS = 256  # of which the commands are remembered at once, beside those of the longest delay
ALONE = filled(1)  # lanes that are computed for one robot


class Runtime:
    """One robot.

    Attributes:
        model: MuJoCo's model, without what the laws do.
        data: MuJoCo's data; places and rates of the robot may be changed between steps.
        joints: Names of the robot's joints, in the order of all arrays here.
        commands: Names of its commands, likewise.
    """

    def __init__(self, completed: Model, file: Any) -> None:
        """A robot at rest, all joints at zero.

        Args:
            completed: The model that was exported.
            file: MuJoCo's compiled model of the exported file, or of a scene with the robot in it.

        Raises:
            InputError: the file lacks a joint of the robot.
        """
        mujoco = mujoco_module()
        plant = completed.plant
        self.joints, self.commands = plant.joints, plant.commands
        known = {file.joint(i).name for i in range(file.njnt)}
        for joint in plant.joints:
            if joint not in known:
                raise InputError(f"the MuJoCo model has no joint {joint}; it has {', '.join(sorted(known))}")
        self._mujoco = mujoco
        self._steps = steps_within(float(file.opt.timestep))
        self._period = float(file.opt.timestep) / self._steps
        self._laws = coefficients(ModelBatch(completed))
        self._laws.on[R.ON_ENGINE] = True
        self._memory = _longest_delay(completed, self._period)
        inputs = Inputs.regular((ROWS + self._memory) * self._period, 1.0 / self._period, len(plant.commands))
        self._layout = Layout(plant, 1, inputs)
        self._exchange = Exchange.of(self._layout.joints, self._layout.width)
        self._world = FileWorld(mujoco, file)
        self._world.load(completed, self._exchange, 1)
        self.model, self.data = self._world.model, self._world.lanes[0].data
        rows = self._layout.rows
        self._unused = (np.zeros((0, 2 * self._layout.width, 1)), np.zeros(1, dtype=np.int64))
        self._held, self._open = self._layout.held(), self._layout.open_loop()
        self._counted = (np.full((rows, 1), self._period), np.ones((rows, 1), dtype=np.int64))
        self.reset()

    @classmethod
    def open(cls, folder: str | Path, scene: str | Path | None = None) -> Self:
        """The robot that `task=export format=mjcf` wrote.

        Args:
            folder: Where it wrote to.
            scene: An MJCF file that has the robot in it; None for the exported file.

        Raises:
            InputError: a file is missing or at fault, or MuJoCo is not installed.
        """
        path = Path(scene) if scene is not None else Path(folder) / "robot.xml"
        if not path.is_file():
            raise InputError(f"{path}: there is no such file; give the folder that task=export format=mjcf wrote to")
        mujoco = mujoco_module()
        try:
            file = mujoco.MjModel.from_xml_path(str(path))
        except ValueError as error:
            raise InputError(f"{path}: {str(error).strip().splitlines()[0]}; expected an MJCF file") from error
        return cls(read_model(Path(folder) / "model.yaml"), file)

    @property
    def period(self) -> float:
        """Length of a step, that of the file [s]."""
        return self._period * self._steps

    @property
    def shown(self) -> np.ndarray:
        """Coordinates as the sensors show them, shape (joints,) [rad or m]."""
        return self._out[self._row, self._layout.pattern[: len(self.joints)], 0]

    @property
    def q(self) -> np.ndarray:
        """True coordinates, shape (joints,) [rad or m]."""
        return self.data.qpos[self._world.places]

    @property
    def v(self) -> np.ndarray:
        """True rates, shape (joints,) [rad/s or m/s]."""
        return self.data.qvel[self._world.order]

    def reset(self, q: Sequence[float] | np.ndarray | None = None, v: Sequence[float] | np.ndarray | None = None):
        """Put the robot somewhere, its drives and sensors without a past.

        Args:
            q: Coordinates, shape (joints,) [rad or m]; None for zero.
            v: Rates, likewise.
        """
        layout, width = self._layout, self._layout.width
        self._mujoco.mj_resetData(self.model, self.data)
        count = len(self.joints)
        self.data.qpos[self._world.places] = np.zeros(count) if q is None else q
        self.data.qvel[self._world.order] = np.zeros(count) if v is None else v
        joints = np.repeat(self._laws.joints[:, :, 0, None], W, axis=2)
        self._rows = np.concatenate([joints.ravel(), np.repeat(self._laws.body[:, 0], W)])
        self._joints = self._rows[: width * R.BLOCK * W].reshape(width, -1)
        self._body = self._rows[width * R.BLOCK * W :]
        self._t = np.full((layout.rows + 1, 1), AFTER_THE_END)
        self._t[0] = 0.0
        self._u = np.zeros((layout.rows, width, 1))
        self._past, self._out = layout.past(self._laws.has), np.zeros((layout.rows + 1, 2 * width, 1))
        self._lanes = np.zeros((2, W), dtype=np.int64)
        self._pointers, self._counts = np.zeros((width, W), dtype=np.int64), np.zeros(W, dtype=np.int64)
        self._row = 0
        laws, X = self._laws, self._exchange.lanes
        self._end_step = settled(between, self._rows, self._body, self._joints, ALONE, X, laws.on, laws.has, laws.rigid)
        self._take_over()
        self._show()

    def step(self, command: Sequence[float] | np.ndarray, steps: int = 1) -> np.ndarray:
        """Hold a command over some steps.

        Args:
            command: As in the recordings' columns `u`, shape (commands,) [N, N m, or the target of a position drive].
            steps: How many.

        Returns:
            Coordinates as the sensors show them at the end, shape (joints,) [rad or m].
        """
        for _ in range(steps * self._steps):
            self._advance(np.asarray(command, dtype=float))
        return self.shown

    def _advance(self, command: np.ndarray) -> None:
        if self._row == self._layout.rows:
            self._forget()
        k, laws, held, open_loop = self._row, self._laws, self._held, self._open
        A, S, B, X = self._rows, self._body, self._joints, self._exchange.lanes
        self._take_over()
        self._u[k, self._layout.driven, 0] = command
        self._t[k + 1] = self._t[k] + self._period
        least, _ = begin(
            S,
            B,
            ALONE,
            laws.on,
            laws.has,
            self._t,
            self._u,
            held,
            *self._counted,
            self._lanes,
            self._counts,
            k,
            0,
            1,
            False,
            open_loop.gains,
            open_loop.references,
            open_loop.noise,
            open_loop.settings,
        )
        before(
            A,
            S,
            B,
            ALONE,
            X,
            laws.on,
            laws.has,
            self._t,
            self._u,
            held,
            self._lanes,
            self._pointers,
            self._counts,
            least,
            0,
        )
        self._world.weigh()
        self._end_step(A, S, B, ALONE, X, laws.on, laws.has, laws.rigid)
        self._world.advance()
        after(S, B, ALONE, X)
        self.data.qpos[self._world.places] = self._places()
        self._row += 1
        self._show()

    def _places(self) -> np.ndarray:
        """Coordinates at the end of the step, shape (joints,)."""
        return self._joints[self._layout.joints, R.Q * W]

    def _take_over(self) -> None:
        """Places and rates of MuJoCo's data, which may have been changed from outside."""
        joints = self._joints[self._layout.joints]
        joints[:, R.Q * W : (R.Q + 1) * W] = self.q[:, None]
        joints[:, R.V * W : (R.V + 1) * W] = self.v[:, None]

    def _show(self) -> None:
        has, past, t, row = self._laws.has, self._past, self._t, self._row
        show(self._joints, ALONE, has, past, t, self._lanes, row, self._out, 0, 1, *self._unused)

    def _forget(self) -> None:
        """Keep the rows of the longest delay only."""
        dropped, kept = self._row - self._memory, self._memory
        self._t[: kept + 1] = self._t[dropped:]
        self._t[kept + 1 :] = AFTER_THE_END
        self._u[:kept], self._out[: kept + 1] = self._u[dropped:], self._out[dropped:]
        if len(self._past) > 1:
            self._past[: kept + 1] = self._past[dropped:]
        self._pointers = np.maximum(self._pointers - dropped, 0)
        self._row = kept


def _longest_delay(model: Model, period: float) -> int:
    """Rows that commands and sensors look back."""
    delays = [values["tau"] for name, values in model.effects.items() if name.endswith("/delay")]
    return int(np.ceil(sum(delays) / period)) + 2
