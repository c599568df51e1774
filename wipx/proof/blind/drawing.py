"""First process of a blind run: draws hidden physics, records the robot, and seals what must not be read."""

import hashlib
from pathlib import Path

import numpy as np

from wipx.effects.catalogue import kinds, of_trees
from wipx.proof.blind_robots.cases import DIRTY_TIERS, draw_case
from wipx.proof.blind_robots.dirty import draw_dirty
from wipx.proof.blind_robots.folder import RunFolder
from wipx.proof.blind_robots.seal import Sealed, seal
from wipx.proof.blind_robots.trees.cases import TREE_TIERS, draw_tree_case
from wipx.proof.blind_robots.trees.write import tree_files
from wipx.proof.blind_robots.write import CaseFiles, case_files, write_files


def draw_and_seal(path: Path, case: str, tier: str, seed: int, lengths: tuple[float, float]) -> Sealed:
    """Draw a case, write its visible recordings and its seal; the key is on no disk, only in what is returned.

    Args:
        path: Folder of the run.
        case: Name of the case.
        tier: Its tier.
        seed: Of the run.
        lengths: Shortest and longest time that a recording lasts [s].
    """
    folder = RunFolder(path)
    own = seed_of(seed, case)
    files = draw_files(np.random.default_rng(own), tier, lengths)
    sealed = seal(case, files.visible, {"seed": own, "truth": files.truth, "unseen": files.unseen})
    write_files(folder.recordings(case), files.visible)
    folder.seal(case).parent.mkdir(parents=True, exist_ok=True)
    folder.seal(case).write_bytes(sealed.token)
    return sealed


def draw_files(
    rng: np.random.Generator, tier: str, lengths: tuple[float, float], joints: int | None = None
) -> CaseFiles:
    """The files of a case of any tier.

    Args:
        rng: Random numbers.
        tier: Its tier.
        lengths: Shortest and longest time that a recording lasts [s].
        joints: Of a robot from a model file; None for a random number.
    """
    if tier in TREE_TIERS:
        known = frozenset((*kinds(), *of_trees()))
        return tree_files(draw_tree_case(rng, tier, lengths, known, joints))
    draw = draw_dirty if tier in DIRTY_TIERS else draw_case
    return case_files(draw(rng, tier, lengths))


def seed_of(seed: int, case: str) -> int:
    """A case's own seed; that of the run cannot be found from it when the case is opened."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{case}".encode()).digest()[:16], "big")
