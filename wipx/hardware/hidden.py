"""The hidden physics of an emulated robot: drawn from a seed, written to a file, read by no identification.

`rich` is physics beyond the paper's model. `paper` is that model and nothing else, so that an identification of it
can be held against the truth.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from wipx.core.model import Model

# Paper, Fig. 3: F_s, F_c, v_s, sigma, epsilon, alpha; forces there without unit, scaled to the robot here.
PAPER_COULOMB, PAPER_PEAK, PAPER_SPEED, PAPER_VISCOUS, PAPER_EPSILON, PAPER_ALPHA = 0.12, 1.25, 0.2, 0.02, 0.01, 0.7


@dataclass(frozen=True)
class HiddenPhysics:
    """A robot as it is.

    Attributes:
        model: Rigid body and effects; of the unloaded robot.
        latency: From a command to its arrival at the drive, mean [s].
        latency_jitter: Its standard deviation [s].
        in_steps: Whether commands and readings of the motor pass its CAN frames, in steps.
        torque_noise: Of the torque that the drive reports, standard deviation [N m].
        encoder_noise: Of the motor's position, white [rad].
        velocity_noise: Of the motor's velocity, white [rad/s].
        angle_bias: Constant error of the IMU's angle [rad].
        angle_noise: Of the IMU's angle, white [rad].
        angle_wander: Of the IMU's angle, of first order with `wander_time` [rad].
        wander_time: Its correlation time [s].
        gyro_noise: Of the IMU's angular rate, white [rad/s].
    """

    model: Model
    latency: float = 0.0
    latency_jitter: float = 0.0
    in_steps: bool = False
    torque_noise: float = 0.0
    encoder_noise: float = 3e-4
    velocity_noise: float = 0.02
    angle_bias: float = 0.0
    angle_noise: float = 5e-4
    angle_wander: float = 0.0
    wander_time: float = 0.03
    gyro_noise: float = 2e-3

    def beside_the_model(self) -> dict[str, float | bool]:
        """Everything but the model, by name, for a file."""
        return {name: value for name, value in vars(self).items() if name != "model"}


def rich_physics(nominal: Model, rng: np.random.Generator) -> HiddenPhysics:
    """Bristle friction with a Stribeck peak, damping, dead zone, backlash, latency, CAN steps, a wandering IMU."""
    effects: dict[str, dict[str, float]] = {}
    for site in nominal.plant.joints:
        passive = site not in nominal.plant.actuated
        scale = _force_scale(nominal, site)
        # Wheels on a rail lose 2 to 5 % of the weight, a bearing at rest much less of the body's moment.
        level = scale * (rng.uniform(0.0018, 0.0046) if passive else rng.uniform(0.02, 0.035))
        bend = rng.uniform(2e-4, 1e-3) if nominal.plant.is_angular(site) else rng.uniform(5e-5, 2e-4)
        effects[f"{site}/lugre"] = {
            "F_c": level,
            "F_s": level * rng.uniform(1.15, 1.5),
            "v_s": rng.uniform(0.01, 0.05),
            "stiffness": level / bend,
            "damping": rng.uniform(0.1, 0.3) * sqrt(level / bend * _inertia_scale(nominal, site)),
        }
        share = rng.uniform(0.0006, 0.0018) if passive else rng.uniform(0.01, 0.03)
        effects[f"{site}/viscous"] = {"sigma": share * scale}
    lever = lever_of(nominal, nominal.plant.actuated[0])
    # An AK80-6: 0.01 to 0.03 N m without effect, 5 to 10 arc minutes of play, a rotor of 2.2e-3 kg m^2 at the output.
    effects["actuator/dead_zone"] = {"band": rng.uniform(0.01, 0.03) / lever}
    effects["actuator/backlash"] = {
        "gap": rng.uniform(1.5e-3, 3e-3) * lever,
        "drive_inertia": 2.2e-3 / lever**2,
        "drive_damping": rng.uniform(0.01, 0.03) / lever**2,
        "returned": 0.0,
        "contact_time": 0.0,
    }
    return HiddenPhysics(
        nominal.with_effects(effects),
        latency=rng.uniform(1e-3, 4e-3),
        latency_jitter=rng.uniform(3e-4, 5e-4),
        in_steps=True,
        torque_noise=0.01,
        encoder_noise=0.0,
        velocity_noise=rng.uniform(0.02, 0.05),
        angle_bias=rng.uniform(2e-3, 4e-3) * (1.0 if rng.uniform() < 0.5 else -1.0),
        angle_noise=1.5e-4,
        angle_wander=rng.uniform(3e-4, 6e-4),
        wander_time=rng.uniform(0.02, 0.06),
        gyro_noise=rng.uniform(1.5e-3, 3e-3),
    )


def paper_physics(nominal: Model, rng: np.random.Generator) -> HiddenPhysics:
    """The paper's joint model (Eq. 5) on every joint, with white sensor noise."""
    effects: dict[str, dict[str, float]] = {}
    for site in nominal.plant.joints:
        scale = _force_scale(nominal, site) * (0.025 if site not in nominal.plant.actuated else 0.25)
        coulomb = PAPER_COULOMB * scale * rng.uniform(0.8, 1.2)
        effects[f"{site}/lagged_stribeck"] = {
            "F_s": coulomb * PAPER_PEAK * rng.uniform(0.95, 1.1),
            "F_c": coulomb,
            "v_s": PAPER_SPEED * rng.uniform(0.8, 1.2),
            "sigma": PAPER_VISCOUS * scale * rng.uniform(0.8, 1.2),
            "epsilon": PAPER_EPSILON * rng.uniform(0.8, 1.2),
            "alpha": PAPER_ALPHA * rng.uniform(0.9, 1.1),
        }
    return HiddenPhysics(nominal.with_effects(effects))


def lever_of(model: Model, site: str) -> float:
    """What a radian of a motor moves its joint by: the wheel's radius [m], or 1 where it turns the joint itself."""
    return 1.0 if model.plant.is_angular(site) else model.parameters["wheel_radius"]


def _mass(model: Model) -> float:
    p = model.parameters
    return p.get("body_mass", p.get("link1_mass", 0.0)) + p.get("wheel_mass", p.get("link2_mass", 0.0))


def _arm(model: Model) -> float:
    p = model.parameters
    return p.get("com_height", p.get("link1_length", 0.0))


def _force_scale(model: Model, site: str) -> float:
    """The weight on a sliding joint [N], its moment on a turning one [N m]."""
    weight = _mass(model) * model.parameters["gravity"]
    return weight * _arm(model) if model.plant.is_angular(site) else weight


def _inertia_scale(model: Model, site: str) -> float:
    """What a joint moves [kg or kg m^2], roughly."""
    return _mass(model) * (_arm(model) ** 2 if model.plant.is_angular(site) else 1.0)
