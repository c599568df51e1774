"""Random trees of hinges and slides, as MJCF."""

import numpy as np


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.17g}" for x in values)


def mjcf(joints: int, rng: np.random.Generator, *, slides: float = 0.2, friction: float = 0.0) -> str:
    """A model file of a tree with that many joints; some bodies have a welded part.

    Args:
        joints: Number of joints.
        rng: Draws the tree.
        slides: Share of slides among the joints.
        friction: Largest dry friction of a joint that the file gives [N or N m].
    """
    opened: list[tuple[int, str]] = []
    for i in range(joints):
        parent = int(rng.integers(-1, i))
        kind = "slide" if rng.random() < slides else "hinge"
        axis = rng.normal(size=3)
        place, turn = rng.uniform(-0.4, 0.4, 3), rng.normal(size=4)
        com, half = rng.uniform(-0.1, 0.1, 3), rng.uniform(0.02, 0.2, 3)
        mass = rng.uniform(0.2, 3.0)
        moments = (
            mass
            / 3.0
            * np.array([half[1] ** 2 + half[2] ** 2, half[0] ** 2 + half[2] ** 2, half[0] ** 2 + half[1] ** 2])
        )
        text = (
            f'<body name="b{i}" pos="{_numbers(place)}" quat="{_numbers(turn)}">'
            f'<inertial pos="{_numbers(com)}" mass="{mass:.17g}" diaginertia="{_numbers(moments)}" '
            f'quat="{_numbers(rng.normal(size=4))}"/>'
            f'<joint name="j{i}" type="{kind}" axis="{_numbers(axis)}" pos="{_numbers(rng.uniform(-0.1, 0.1, 3))}" '
            f'armature="{rng.uniform(0.0, 0.1):.17g}" frictionloss="{friction * rng.random():.17g}"/>'
        )
        if rng.random() < 0.3:
            welded = _numbers(rng.uniform(-0.2, 0.2, 3))
            text += f'<body name="w{i}" pos="{welded}"><geom type="sphere" size="0.05"/></body>'
        opened.append((parent, text))
    children: dict[int, list[int]] = {}
    for i, (parent, _) in enumerate(opened):
        children.setdefault(parent, []).append(i)

    def written(i: int) -> str:
        return opened[i][1] + "".join(written(child) for child in children.get(i, ())) + "</body>"

    bodies = "".join(written(i) for i in children[-1])
    gravity = _numbers(rng.normal(size=3) * 5.0)
    return f'<mujoco><option gravity="{gravity}"/><worldbody>{bodies}</worldbody></mujoco>'
