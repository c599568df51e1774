"""A plant as an MJCF: the rigid body of contract section 2 and the effects that MuJoCo has as built-in parameters.

Effects on the signals (delays, scales, biases) are not in here: the toolbox leaves them to whoever prepares
commands and compares recordings, see `wipx.rivals.mujoco_problem`.
"""

from collections.abc import Mapping

from wipx.core.model import Model

BUILT_IN = ("viscous", "coulomb", "gain", "inertia")  # damping, frictionloss, gear, inertia
LEAST = 1e-9  # [kg, kg m^2]; MuJoCo refuses bodies without mass or inertia

# y points into the page and a hinge about -y turns the upright body towards -x, as contract section 2 has it.
HINGE = 'type="hinge" axis="0 -1 0"'
SLIDE = 'type="slide" axis="1 0 0"'


def mjcf(model: Model, step: float) -> str:
    """The plant as MuJoCo's XML.

    Args:
        model: Rigid body and effects; those that are not `BUILT_IN` are left out.
        step: Of the integrator [s].
    """
    bodies = {"pendulum": _pendulum, "linear_axis": _linear_axis, "double_pendulum": _double_pendulum}
    plant = model.plant
    gear = model.parameters["input_gain"] * _value(model, "actuator/gain", "k", 1.0)
    motors = "".join(
        f'<motor name="{command}" joint="{joint}" gear="{gear!r}"/>'
        for command, joint in zip(plant.commands, plant.actuated, strict=True)
    )
    sensors = "".join(
        f'<jointpos name="{column}" joint="{joint}"/>'
        for joint, column in zip(plant.joints, plant.coordinates, strict=True)
    )
    return (
        f'<mujoco><option timestep="{step!r}" gravity="0 0 {-model.parameters.get("gravity", 0.0)!r}" '
        f'tolerance="1e-10"><flag contact="disable"/></option>'
        f"<worldbody>{bodies.get(plant.kind, _cart_and_body)(model)}</worldbody>"
        f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


def _cart_and_body(model: Model) -> str:
    p = model.parameters
    return f"<body>{_rail(model)}{_inertial(p['wheel_mass'], 0.0, 0.0)}{_upright(model)}</body>"


def _pendulum(model: Model) -> str:
    return _upright(model)


def _linear_axis(model: Model) -> str:
    p = model.parameters
    return f"<body>{_rail(model)}{_inertial(p['body_mass'] + p['wheel_mass'], 0.0, 0.0)}</body>"


def _double_pendulum(model: Model) -> str:
    """Two links that hang; one lighter to turn than a point at its centre of mass exists in no MJCF."""
    p = model.parameters
    links = [
        _joint(model, f"joint{i}", HINGE)
        + _inertial(
            p[f"link{i}_mass"], -p[f"link{i}_com"], p[f"link{i}_inertia"] - p[f"link{i}_mass"] * p[f"link{i}_com"] ** 2
        )
        for i in (1, 2)
    ]
    return f'<body>{links[0]}<body pos="0 0 {-p["link1_length"]!r}">{links[1]}</body></body>'


def _rail(model: Model) -> str:
    """The joint of the wheels; what turns with them resists like a mass I_w / r^2 on the rail."""
    p = model.parameters
    return _joint(model, "translation", SLIDE, armature=p["wheel_inertia"] / p["wheel_radius"] ** 2)


def _upright(model: Model) -> str:
    p = model.parameters
    inertia = p["body_inertia"] * _value(model, "geometry/inertia", "scale", 1.0)
    return f"<body>{_joint(model, 'pitch', HINGE)}{_inertial(p['body_mass'], p['com_height'], inertia)}</body>"


def _joint(model: Model, site: str, kind: str, armature: float = 0.0) -> str:
    damping, friction = _value(model, f"{site}/viscous", "sigma", 0.0), _value(model, f"{site}/coulomb", "F_c", 0.0)
    return f'<joint name="{site}" {kind} armature="{armature!r}" damping="{damping!r}" frictionloss="{friction!r}"/>'


def _inertial(mass: float, height: float, inertia: float) -> str:
    about = max(inertia, LEAST)
    return f'<inertial pos="0 0 {height!r}" mass="{max(mass, LEAST)!r}" diaginertia="{about!r} {about!r} {about!r}"/>'


def _value(model: Model, effect: str, symbol: str, neutral: float) -> float:
    values: Mapping[str, float] = model.effects.get(effect, {})
    return values.get(symbol, neutral)
