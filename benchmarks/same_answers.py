"""Whether a change of the program leaves every answer as it was, number for number.

    python benchmarks/same_answers.py --out runs/answers_before FOLDER...   # before the change
    python benchmarks/same_answers.py --out runs/answers_after --against runs/answers_before FOLDER...

Each FOLDER holds recordings and a robot.yaml. Answers that are in `--out` already are not made again. Run each command
twice and keep the second answers: freshly compiled code may round otherwise than code that was read from the cache.
"""

import argparse
import json
import sys
from pathlib import Path

from tqdm import tqdm

from wipx import diagnose
from wipx.report.diagnosis_json import diagnosis_json


def answer(folder: Path) -> str:
    """diagnosis.json of recordings, without the time that it took."""
    content = diagnosis_json(diagnose(folder))
    return json.dumps({**content, "seconds": 0.0}, indent=1, sort_keys=True)


def main() -> int:
    """Make the answers that are missing, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder for the answers")
    parser.add_argument("--against", type=Path, help="folder of earlier answers")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    different = 0
    for folder in tqdm(arguments.folders, unit="answer"):
        name = f"{'_'.join(folder.resolve().parts[-3:])}.json"
        path = arguments.out / name
        if not path.is_file():
            path.write_text(answer(folder), encoding="utf-8")
        if arguments.against and path.read_bytes() != (arguments.against / name).read_bytes():
            different += 1
            print(f"{folder}: another answer", file=sys.stderr)
    if arguments.against:
        print(f"{len(arguments.folders) - different} of {len(arguments.folders)} answers are equal")
    return 1 if different else 0


if __name__ == "__main__":
    raise SystemExit(main())
