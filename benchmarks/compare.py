"""Diagnoses of the working tree beside those of an earlier commit: the same answers, and how much faster.

    python benchmarks/compare.py REV FOLDER...

Each FOLDER holds recordings and a robot.yaml. One process per tree diagnoses all folders, in turn with the other; the
first folder is diagnosed once before, untimed, since both compile. Processor times are those of all threads.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from timing import print_table
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
SAME = 1e-3  # of the width of its interval, within which a value is the same
WORKER = """
import json, resource, sys, time
import wipx
for line in sys.stdin:
    begun = time.process_time()
    found = wipx.diagnose(line.strip())
    spent = time.process_time() - begun
    each = [number for effect in found.effects for number in effect.parameters]
    numbers = {number.name: (number.value, number.low, number.high) for number in each}
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"seconds": spent, "memory": memory, "verdict": found.verdict, "numbers": numbers}), flush=True)
"""


@dataclass(frozen=True)
class Answer:
    """One diagnosis.

    Attributes:
        seconds: Processor time.
        memory: Largest of the process so far [MiB].
        verdict: Of the diagnosis.
        numbers: Value and 95 % interval of each number of the effects found, by name [SI].
    """

    seconds: float
    memory: float
    verdict: str
    numbers: dict[str, tuple[float, float, float]]

    def is_same(self, other: "Answer") -> bool:
        """Whether verdict and names are equal, and values within a small part of their intervals."""
        if self.verdict != other.verdict or self.numbers.keys() != other.numbers.keys():
            return False
        pairs = [(self.numbers[name], other.numbers[name]) for name in self.numbers]
        return all(abs(one[0] - two[0]) <= SAME * max(two[2] - two[1], 1e-300) for one, two in pairs)


class Tree:
    """A process that diagnoses with the package of one source tree."""

    def __init__(self, source: Path) -> None:
        # The package of the folder in which Python starts comes before that which is installed.
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER], cwd=source, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def diagnose(self, folder: Path) -> Answer:
        """Diagnose the recordings of a folder.

        Raises:
            RuntimeError: the process ended.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(folder.resolve(), file=self._process.stdin, flush=True)
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"{folder}: the diagnosis failed")
        return Answer(**json.loads(line))


@contextmanager
def checked_out(revision: str) -> Iterator[Path]:
    """The source tree of a revision, as long as the block runs."""
    with tempfile.TemporaryDirectory() as place:
        packed = subprocess.run(["git", "archive", revision], cwd=ROOT, check=True, capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", place], input=packed, check=True)
        yield Path(place)


def main() -> int:
    """Diagnose with both trees, and print one row for each folder and the ratios of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision", help="commit to compare with")
    parser.add_argument("folders", nargs="+", type=Path)
    arguments = parser.parse_args()
    with checked_out(arguments.revision) as earlier:
        trees = (Tree(earlier), Tree(ROOT))
        for tree in trees:
            tree.diagnose(arguments.folders[0])
        pairs = [tuple(tree.diagnose(folder) for tree in trees) for folder in tqdm(arguments.folders, unit="folder")]
    rows = [
        (folder.name, f"{one.seconds:.1f}", f"{two.seconds:.1f}", f"{one.seconds / two.seconds:.2f}",
         "yes" if two.is_same(one) else "no", ", ".join(two.numbers) or "nothing")
        for folder, (one, two) in zip(arguments.folders, pairs, strict=True)
    ]  # fmt: skip
    print_table("Processor time of a diagnosis", ("folder", "before [s]", "now [s]", "ratio", "same", "found"), rows)
    before, now = (np.array([pair[i].seconds for pair in pairs]) for i in (0, 1))
    summary = [
        (name, f"{measure(before):.1f}", f"{measure(now):.1f}")
        for name, measure in (("median [s]", np.median), ("95th percentile [s]", lambda x: np.quantile(x, 0.95)))
    ]
    memory = ("largest memory [MiB]", *(f"{each.memory:.0f}" for each in pairs[-1]))
    print_table("All", ("", "before", "now"), [*summary, memory])
    print(f"\nbefore / now: {np.median(before / now):.2f} in the median")
    print(f"the same answer: {sum(two.is_same(one) for one, two in pairs)} of {len(pairs)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
