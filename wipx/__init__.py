"""Real-to-sim adaptation of balancing robots: identify, diagnose, estimate, control."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wipx.core.diagnosis import Diagnosis
    from wipx.core.recording import Recording
    from wipx.recordings.robot_file import RobotDescription


def diagnose(
    recordings: "str | Path | Sequence[Recording]",
    robot: "str | Path | RobotDescription | None" = None,
    *,
    suspects: Mapping[str, Mapping[str, float]] | None = None,
) -> "Diagnosis":
    """Find out what physics a nominal model lacks.

        diagnosis = wipx.diagnose("my_robot")          # a folder with robot.yaml and recordings
        print(diagnosis.sentence)
        for effect in diagnosis.effects:
            print(effect.name, [(p.name, p.value, p.low, p.high, p.unit) for p in effect.parameters])

    Args:
        recordings: A folder of recordings, or recordings in SI.
        robot: The nominal model: a robot.yaml or the result of `read_robot`; None for the folder's own.
        suspects: Effects to test after the answer is complete; they do not change it. By "site/kind", each with the
            suspected values by symbol [SI], or with none, e.g. {"pitch/coulomb": {"F_c": 0.29}}.

    Raises:
        InputError: a file is missing or invalid, a suspect does not exist on this robot, recordings are too short or
            contradict the model grossly.
    """
    from wipx.library import diagnose_robot

    return diagnose_robot(recordings, robot, suspects)
