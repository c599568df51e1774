"""The loop that the analytic simulator replaces: PyBullet stepped from Python."""

import importlib
import importlib.util
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from math import sin
from pathlib import Path

from kernel import BODY, RATE, ROUNDS, ROWS, Case
from timing import interleaved, print_table

NO_TENSOR = 'ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"'
TENSOR = 'ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"'
BODIES = f"""<robot name="wip">
  <link name="rail"><inertial><mass value="0"/><inertia {NO_TENSOR}/></inertial></link>
  <link name="cart"><inertial><mass value="{{cart}}"/><inertia {TENSOR}/></inertial></link>
  <link name="body">
    <inertial><origin xyz="0 0 {{height}}"/><mass value="{{mass}}"/><inertia {TENSOR}/></inertial>
  </link>
  <joint name="x" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-100" upper="100" effort="1000" velocity="100"/></joint>
  <joint name="pitch" type="continuous"><parent link="cart"/><child link="body"/><axis xyz="0 -1 0"/></joint>
</robot>
"""


class BulletLoop:
    """One rollout: both joints read, torques computed and set, one step, as often as there are rows."""

    def __init__(self, bullet, client: int, body: int) -> None:
        self.bullet = bullet
        self.client = client
        self.body = body

    def __call__(self) -> None:
        """Simulate one rollout."""
        bullet, client, body = self.bullet, self.client, self.body
        bullet.resetJointState(body, 0, 0.0, physicsClientId=client)
        bullet.resetJointState(body, 1, 0.02, physicsClientId=client)
        for k in range(ROWS):
            force = 3.0 * sin(6.0 * 3.14159 * k / RATE)
            for joint, push in ((0, force), (1, 0.0)):
                rate = bullet.getJointState(body, joint, physicsClientId=client)[1]
                torque = push - 0.02 * rate
                bullet.setJointMotorControl2(body, joint, bullet.TORQUE_CONTROL, force=torque, physicsClientId=client)
            bullet.stepSimulation(physicsClientId=client)


@contextmanager
def bullet_loop() -> Iterator[BulletLoop]:
    """The loop, with PyBullet connected."""
    bullet = importlib.import_module("pybullet")
    cart = BODY["wheel_mass"] + BODY["wheel_inertia"] / BODY["wheel_radius"] ** 2
    client = bullet.connect(bullet.DIRECT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "wip.urdf")
            path.write_text(
                BODIES.format(
                    cart=cart, height=BODY["com_height"], mass=BODY["body_mass"], inertia=BODY["body_inertia"]
                )
            )
            body = bullet.loadURDF(str(path), useFixedBase=True, physicsClientId=client)
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        bullet.setTimeStep(1.0 / RATE, physicsClientId=client)
        for joint in range(2):  # the joints' own motors
            bullet.setJointMotorControl2(body, joint, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        yield BulletLoop(bullet, client, body)
    finally:
        bullet.disconnect(client)


def measure_engines() -> dict[str, float] | None:
    """Steps per second of PyBullet and of the analytic simulator in the same rounds; None without PyBullet."""
    if importlib.util.find_spec("pybullet") is None:
        print("\nPyBullet is not installed and was left out; install it with: pip install 'wipx[bench]'")
        return None
    cases = {f"analytic, batch {batch}": Case("paper friction on both joints", batch, 1) for batch in (1, 64, 1024)}
    with bullet_loop() as loop:
        calls = {"PyBullet, one loop in Python": loop, **{name: case.rollout() for name, case in cases.items()}}
        timings = interleaved(calls, ROUNDS)
    slow = ROWS / timings["PyBullet, one loop in Python"].median
    rates = {name: (cases[name].steps if name in cases else ROWS) / t.median for name, t in timings.items()}
    print_table(
        f"Beside a physics engine, {ROWS} steps at {RATE:g} Hz, one thread",
        ("engine", "million steps/s", "ratio"),
        [(name, f"{rate / 1e6:.3f}", f"{rate / slow:.0f}") for name, rate in rates.items()],
    )
    return rates
