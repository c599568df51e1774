"""First process of a blind run: draws hidden physics, records the robot, and seals what must not be read."""

import hashlib
from pathlib import Path

import numpy as np

from wipx.proof.blind_robots.cases import DIRTY_TIERS, draw_case
from wipx.proof.blind_robots.dirty import draw_dirty
from wipx.proof.blind_robots.folder import RunFolder
from wipx.proof.blind_robots.seal import Sealed, seal
from wipx.proof.blind_robots.write import case_files, write_files


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
    draw = draw_dirty if tier in DIRTY_TIERS else draw_case
    files = case_files(draw(np.random.default_rng(own), tier, lengths))
    sealed = seal(case, files.visible, {"seed": own, "truth": files.truth, "unseen": files.unseen})
    write_files(folder.recordings(case), files.visible)
    folder.seal(case).parent.mkdir(parents=True, exist_ok=True)
    folder.seal(case).write_bytes(sealed.token)
    return sealed


def seed_of(seed: int, case: str) -> int:
    """A case's own seed; that of the run cannot be found from it when the case is opened."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{case}".encode()).digest()[:16], "big")
