"""Joints and drives of a completed model in the names of Isaac Lab's actuator configuration.

Isaac Lab has no bodies in it (it takes them from URDF or MJCF). Each joint is a group of its own, of the class whose
fields say most of it: `DCMotorCfg` for a torque-speed line, `DelayedPDActuatorCfg` for a delay, else
`ImplicitActuatorCfg`. `friction` and `dynamic_friction` are forces and torques, as in Isaac Sim 5.
"""

from math import inf

import numpy as np
import yaml

from wipx.core.model import Model
from wipx.export.drive_terms import DriveTerms, drive_terms
from wipx.sim.mechanism import mechanism

HEAD = """# Actuators for Isaac Lab, one group for each joint: isaaclab.actuators.CLASS(**settings without class).
# physics_dt is the step for which delays are counted. What Isaac Lab cannot say is in export.json of the MJCF.
"""


def isaac_actuators(model: Model, step: float) -> str:
    """YAML of the actuator groups.

    Args:
        model: The completed model.
        step: Of the physics [s], in which delays are counted.
    """
    drives = {model.plant.actuated[i]: drive_terms(model, c, step) for i, c in enumerate(model.plant.commands)}
    groups = {
        link.joint: _group(model, link.joint, link.armature, drives.get(link.joint), step)
        for link in mechanism(model).tree.links
    }
    return HEAD + yaml.safe_dump({"physics_dt": step, "actuators": groups}, sort_keys=False)


def _group(model: Model, joint: str, armature: float, drive: DriveTerms | None, step: float) -> dict[str, object]:
    static, sliding, viscous = _friction(model, joint)
    settings: dict[str, object] = {"class": "ImplicitActuatorCfg", "joint_names_expr": [joint]}
    stiffness, damping = (0.0, 0.0) if drive is None or drive.servo is None else drive.servo
    settings |= {"stiffness": float(stiffness), "damping": float(damping)}
    if drive is not None:
        largest = float(np.min(np.abs(drive.forces)))
        if drive.line is not None:
            settings["class"] = "DCMotorCfg"
            settings |= {"saturation_effort": drive.line.stall, "velocity_limit": drive.line.free}
            settings["effort_limit"] = largest
        elif drive.delay:
            steps = round(drive.delay / step)
            settings["class"] = "DelayedPDActuatorCfg"
            settings |= {"min_delay": steps, "max_delay": steps}
            settings |= {"effort_limit": largest} if largest < inf else {}
        elif largest < inf:
            settings["effort_limit_sim"] = largest
    settings |= {"armature": float(armature), "friction": static, "dynamic_friction": sliding}
    return settings | {"viscous_friction": viscous}


def _friction(model: Model, joint: str) -> tuple[float, float, float]:
    """Static level, level of sliding, and viscous coefficient of a joint, its back-EMF among the last."""
    base = model.parameters.get(f"{joint}.friction", 0.0)
    static = sliding = base
    viscous = model.parameters.get(f"{joint}.damping", 0.0)
    for name, p in model.effects.items():
        if name.partition("/")[0] != joint:
            continue
        level = p.get("F_c", 0.5 * (p.get("F_plus", 0.0) + p.get("F_minus", 0.0)))
        if not name.endswith("/sticky_spot"):
            sliding += level
            static += max(p.get("F_s", level), level)
        viscous += p.get("sigma", 0.0)
    return float(static), float(sliding), float(viscous)
