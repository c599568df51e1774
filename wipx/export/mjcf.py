"""A completed model as MJCF: the owner's own file, or the model's tree, with what MuJoCo can say of its effects.

Terms of joints and drives are worked out in `joint_terms` and `drive_terms`, and written by `spec_writer`.
"""

import importlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.core.export_result import Statement
from wipx.core.model import Model
from wipx.export.drive_terms import drive_terms
from wipx.export.owner_file import owner_file
from wipx.export.spec_writer import SpecWriter
from wipx.sim.mechanism import Mechanism, check_possible, mechanism
from wipx.sim.mjcf import bodies, option

STEP = 1e-3  # [s] of files that are built from a tree


@dataclass(frozen=True)
class ExportedFile:
    """A file for another simulator.

    Attributes:
        text: Its content.
        model: MuJoCo's compiled model of that content.
        step: Of the integrator [s].
        source: The owner's file that it was built from; None where it was built from the model's tree.
        note: Why the owner's file was not used; empty where it was, or where there is none.
        statements: What became of every effect.
        has_runtime: Whether `wipx.export.mujoco_runtime` steps it.
    """

    text: str
    model: Any
    step: float
    source: Path | None
    note: str
    statements: tuple[Statement, ...]
    has_runtime: bool = True


def mujoco_module() -> Any:
    """MuJoCo.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ModuleNotFoundError as error:
        raise InputError('task=export needs MuJoCo, which is not installed; pip install "mujoco>=4.0,<5"') from error


def export_mjcf(model: Model, step: float | None = None) -> ExportedFile:
    """A completed model as MJCF.

    Args:
        model: The completed model.
        step: Of the integrator [s]; None keeps that of the owner's file.

    Raises:
        InputError: MuJoCo is not installed, or a link is no rigid body.
    """
    mujoco = mujoco_module()
    check_possible(model, "task=export", "")
    found, owner = mechanism(model), owner_file(model, mujoco)
    note = owner.note
    if owner.spec is not None:
        try:
            return _file(mujoco, model, found, owner.spec, owner.path, step)
        except ValueError as error:
            note = str(error).strip().splitlines()[0].rstrip(".;")
    spec = mujoco.MjSpec.from_string(_tree_xml(model, found, step or STEP))
    built = _file(mujoco, model, found, spec, None, step)
    return ExportedFile(built.text, built.model, built.step, None, note, built.statements)


def compiled_urdf(model: Model, found: Mechanism, text: str, step: float) -> Any:
    """MuJoCo's model of a URDF file, with the drives that the owner believes in, which the file cannot say."""
    mujoco = mujoco_module()
    spec = mujoco.MjSpec.from_string(text)
    spec.option.timestep, spec.option.gravity = step, found.tree.gravity
    writer = SpecWriter(mujoco, replace(model, effects={}), found, spec, own=False)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for command in model.plant.commands:
        writer.drive(drive_terms(writer.model, command, step))
    return spec.compile()


def _file(mujoco: Any, model: Model, found: Mechanism, spec: Any, source: Path | None, step: float | None):
    if step is not None:
        spec.option.timestep = step
    statements = SpecWriter(mujoco, model, found, spec, own=source is not None).write()
    spec.compile()
    text = spec.to_xml()
    compiled = mujoco.MjModel.from_xml_string(text)
    return ExportedFile(text, compiled, float(compiled.opt.timestep), source, "", statements)


def _tree_xml(model: Model, found: Mechanism, step: float) -> str:
    """The bare tree; a payload that comes is there without its mass."""
    limits = {
        link.joint: f' limited="true" range="{link.limits[0]!r} {link.limits[1]!r}"'
        for link in found.tree.links
        if link.limits is not None
    }
    head = f'<mujoco model="{model.plant.kind}"><compiler angle="radian"/>{option(found.tree, step)}'
    return f"{head}<worldbody>{bodies(found, limits)}</worldbody></mujoco>"
