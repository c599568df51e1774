"""`task=new`: from a model file and a log to a folder that every other task can be given."""

import filecmp
import shutil
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path

from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.core.results import HORIZON, Trace
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.recordings.matching.log import read_log
from wipx.recordings.matching.robot_yaml import robot_yaml
from wipx.recordings.matching.setup import Setup, set_up
from wipx.recordings.robot_model import read_drives, read_tree
from wipx.recordings.source import ROBOT_FILE, RecordingSource
from wipx.report.replay_page import Replay, write_replay_page
from wipx.tasks.files.results import written_together
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress

PAGE = "robot.html"
LONGEST = 30.0  # [s] of a recording that the page replays


@dataclass(frozen=True)
class NewRobot:
    """Set up a robot.

    Attributes:
        path: Folder that takes the result.
        model: MJCF or URDF file.
        log: CSV or Parquet files of one kind, each of one run, or patterns.
        locked: Joints that do not move, with their positions [rad or m].
        overwrite: Whether a robot.yaml that is there may be replaced.
    """

    path: str
    model: str
    log: list[str]
    locked: dict[str, float] = field(default_factory=dict)
    overwrite: bool = False

    def run(self, job: Job) -> None:
        """Match, write, replay."""
        folder, model = Path(self.path).expanduser(), Path(self.model).expanduser()
        if (folder / ROBOT_FILE).exists() and not self.overwrite:
            raise InputError(f"{folder / ROBOT_FILE} is there already; give another path, or task.overwrite=true")
        with StageProgress("new") as progress:
            progress("model file", 0.0)
            tree, in_file = read_tree(model, self.locked), read_drives(model, self.locked)
            progress("logs", 0.05)
            logs = [read_log(path) for path in self._logs()]
            progress("which column is which joint", 0.1)
            setup = set_up(tree, in_file, logs)
            with written_together(folder) as draft:
                for path in (model, *(log.path for log in logs)):
                    _copy(path, draft, folder)
                names = [log.path.name for log in logs]
                text = robot_yaml(setup, tree, model.name, self.locked, names)
                (draft / ROBOT_FILE).write_text(text, encoding="utf-8")
                progress("simulation beside the recording; the first use of a robot compiles its equations", 0.5)
                source = RecordingSource(path=str(draft), files=names)
                replay = self._replay(job, source, setup)
                write_replay_page(replay, draft / PAGE)
        self._tell(setup, folder)

    def _logs(self) -> list[Path]:
        """The files, in the order in which they were given."""
        found: dict[str, Path] = {}
        for pattern in self.log:
            paths = [Path(each) for each in sorted(glob(str(Path(pattern).expanduser())))]
            if not paths:
                raise InputError(f"{pattern}: there is no such log; give CSV or Parquet files, e.g. log=run1.csv")
            for path in paths:
                other = found.setdefault(path.name, path)
                if other.resolve() != path.resolve():
                    raise InputError(f"{path} and {other} have one name; rename one of them")
        return list(found.values())

    def _replay(self, job: Job, source: RecordingSource, setup: Setup) -> Replay:
        """The first recording beside the nominal simulation."""
        description = source.describe()
        plant = description.model.plant
        assert plant.tree is not None
        recording = _shown(source.load()[0])
        judge = Judge(job.part("sim"), sensor_noise((recording,), plant), HORIZON)
        errors, traces = judge.compare(description.model, description.model, (recording,), held_out=False)
        trace: Trace = traces[0]
        return Replay(
            Path(self.path).resolve().name, plant, trace, errors, dict(setup.reasons), setup.doubts, self._next()
        )

    def _next(self) -> tuple[str, ...]:
        path = self.path if " " not in self.path else f"'{self.path}'"
        return (
            f"python -m wipx task=diagnose recordings.path={path}",
            f"python -m wipx task=identify recordings.path={path}",
        )

    def _tell(self, setup: Setup, folder: Path) -> None:
        for joint, reason in setup.reasons.items():
            print(f"{joint}: {reason}")
        for doubt in setup.doubts:
            print(f"not sure: {doubt}")
        print(f"\nwritten: {folder / ROBOT_FILE}\npage: {folder / PAGE}\nnext: {self._next()[0]}")


def _copy(path: Path, draft: Path, folder: Path) -> None:
    """Copy a file for a folder, which must not have another one of that name."""
    there = folder / path.name
    if there.is_file() and not filecmp.cmp(path, there, shallow=False):
        raise InputError(f"{there} is there already and differs from {path}; rename one of them, or give another path")
    shutil.copyfile(path, draft / path.name)


def _shown(recording: Recording) -> Recording:
    return recording.between(recording.t[0], recording.t[0] + LONGEST)
