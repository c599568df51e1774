"""`task=blind_practice`: robots with hidden physics whose answers lie beside them, to try a method on."""

from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from wipx.core.errors import InputError, unknown_name
from wipx.proof.blind.drawing import draw_files, seed_of
from wipx.proof.blind_robots.cases import DIRTY_TIERS, TIERS, stratified
from wipx.proof.blind_robots.scenario import LENGTHS
from wipx.proof.blind_robots.trees.cases import TREE_TIERS
from wipx.proof.blind_robots.write import write_files
from wipx.tasks.files.results import write_json, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class BlindPractice:
    """Draw cases as the blind benchmark does, and leave everything in the open.

    Each case gets a folder with `visible/` (what a diagnosis reads), `unseen/` (what judges it) and `answer.json`.

    Attributes:
        cases: How many.
        seed: Of the draws.
        lengths: Shortest and longest time that a recording lasts [s].
        tiers: Tiers to draw from.
        joints: Of each robot of a tree tier; None for a random number.
    """

    cases: int = 5
    seed: int = 1
    lengths: tuple[float, float] = LENGTHS
    tiers: tuple[str, ...] = tuple(TREE_TIERS)
    joints: int | None = None

    def __post_init__(self) -> None:
        if self.cases < 1:
            raise InputError(f"task.cases is {self.cases}, expected 1 or more")
        if self.joints is not None and not 1 <= self.joints <= 7:
            raise InputError(f"task.joints is {self.joints}, expected 1 to 7")
        known = {**TIERS, **DIRTY_TIERS, **TREE_TIERS}
        for tier in self.tiers:
            if tier not in known:
                raise unknown_name("tier", tier, known, "task.tiers")

    def run(self, job: Job) -> None:
        """Draw all cases."""
        tiers = stratified(self.cases, 0, self.tiers, np.random.default_rng(self.seed))
        for number, tier in enumerate(tqdm(tiers, desc="draw", leave=False, disable=None), start=1):
            name = f"case{number:04d}"
            rng = np.random.default_rng(seed_of(self.seed, name))
            files = draw_files(rng, tier, self.lengths, self.joints)
            with written_together(job.out / name) as folder:
                write_files(folder / "visible", files.visible)
                write_files(folder / "unseen", files.unseen)
                write_json(folder / "answer.json", dict(files.truth))
            effects = [effect["name"] for effect in files.truth["effects"]]
            outside = files.truth["outside"]
            if outside is not None:
                effects.append(f"outside the vocabulary: {outside['name']}")
            print(f"{name}: {files.truth['plant']}, {tier}: {', '.join(effects) or 'nothing'}", flush=True)
        print(f"written to {job.out}")
