"""What recorded forces ask for, beside what is hidden, on robots drawn in the open.

`python -m wipx task=blind_practice task.cases=20 'task.tiers=[tree_few,tree_many]' hydra.run.dir=FOLDER` draws robots;
`python benchmarks/recorded_forces.py FOLDER` prints what is asked for of each and the sums.
"""

import argparse
import json
import time
from pathlib import Path

from wipx.diagnosis.candidates.torque_regression import numbers_by_forces
from wipx.diagnosis.pipeline import in_two
from wipx.recordings.source import RecordingSource


def main(cases: list[Path]) -> None:
    """Ask for every robot, each in a folder of its own."""
    hits = missed = others = 0
    seconds = []
    for case in cases:
        hidden = {effect["name"] for effect in json.loads((case / "answer.json").read_text())["effects"]}
        source = RecordingSource(str(case / "visible"))
        model, recordings = source.describe().model, source.load()
        begun = time.process_time()
        numbers = numbers_by_forces(model, in_two(recordings))
        seconds.append(time.process_time() - begun)
        asked = {name.rpartition(".")[0] for name, number in numbers.items() if number.asked}
        hits, missed, others = hits + len(asked & hidden), missed + len(hidden - asked), others + len(asked - hidden)
        print(f"{case.name}: {len(model.plant.joints)} joints, {seconds[-1]:.1f} s")
        print(f"  hidden and asked for: {', '.join(sorted(asked & hidden)) or '-'}")
        print(f"  hidden only: {', '.join(sorted(hidden - asked)) or '-'}")
        print(f"  asked for only: {', '.join(sorted(asked - hidden)) or '-'}", flush=True)
    print(f"of {hits + missed} hidden effects {hits} are asked for, and {others} that are not hidden")
    print(f"{sorted(seconds)[len(seconds) // 2]:.1f} s in the median, {max(seconds):.1f} s at most")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of task=blind_practice")
    folder = parser.parse_args().folder
    drawn = sorted(path.parent for path in folder.glob("*/answer.json"))
    if not drawn:
        parser.error(f"{folder} has no folder with an answer.json; draw robots with task=blind_practice")
    main(drawn)
