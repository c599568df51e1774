"""The command line as a user meets it: exit status, one line on an error, nothing left behind."""

import errno
import subprocess
import sys
import types
from pathlib import Path

import pytest
import yaml
from stub_task import StubTask
from tasks.conftest import Answer, program_in

from wipx.app import configuration_folder, explanation, help_text
from wipx.renamed import renamed

SLOW_PACKAGES = {"torch", "mlflow", "pybullet", "numba", "scipy", "matplotlib", "plotly", "pandas"}
REPORT_IMPORTS = f"""
import sys
from wipx.app import main
status = main()
print("imported", sorted({SLOW_PACKAGES!r} & set(sys.modules)))
sys.exit(status)
"""


class CommandLine:
    """Runs the program in a folder, with the options of `stub_task` beside those that ship."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self._run = folder, program_in(folder, capsys, monkeypatch)
        module = types.ModuleType("wipx.stub")
        vars(module)["StubTask"] = StubTask
        monkeypatch.setattr(StubTask, "__module__", "wipx.stub")
        monkeypatch.setitem(sys.modules, "wipx.stub", module)
        self.options = folder / "options"
        root = yaml.safe_load((configuration_folder() / "config.yaml").read_text())
        groups = {
            group: option for item in root["defaults"] if isinstance(item, dict) for group, option in item.items()
        }
        groups["task"] = "stub"
        for group, option in groups.items():
            file = self.options / group / f"{option}.yaml"
            file.parent.mkdir(parents=True)
            file.write_text("_target_: wipx.stub.StubTask\nbehaviour: succeed\n")

    def __call__(self, *arguments: str) -> Answer:
        return self._run(f"--config-dir={self.options}", "task=stub", *arguments)


@pytest.fixture
def command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> CommandLine:
    return CommandLine(tmp_path, capsys, monkeypatch)


def in_a_process(folder: Path, *command: str) -> Answer:
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    return Answer(done.returncode, done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("argument", "name"),
    [
        ("rival=regression", "baseline=regression"),
        ("rival.behaviour=refuse", "baseline.behaviour=refuse"),
        ("~rival", "~baseline"),
        ("+task.rivals=[a]", "+task.baselines=[a]"),
        ("task=concealed", "task=blind"),
        ("target.engine=analytic", "sim@target.engine=analytic"),
        ("target.engine.step=1e-3", "target.engine.step=1e-3"),
        ("+experiment=concealed", "+experiment=blind"),
        ("arrival=1", "arrival=1"),
        ("task.rivalry=1", "task.rivalry=1"),
    ],
)
def test_a_key_with_another_name_is_taken_and_its_name_is_said_once(
    argument: str, name: str, capsys: pytest.CaptureFixture[str]
):
    assert renamed([argument, "seed=1"]) == [name, "seed=1"]
    said = "" if name == argument else f"{argument}: the name is {name}\n"
    assert capsys.readouterr().err == said


def test_a_command_with_another_name_runs(command_line: CommandLine):
    answer = command_line("rival=regression", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "rival=regression: the name is baseline=regression\n")


def test_a_task_gets_its_settings_and_leaves_its_configuration(command_line: CommandLine):
    answer = command_line(
        "seed=3",
        "effects=[translation/coulomb]",
        "free={pitch/viscous.sigma: 0.5, body_mass: null}",
        "bounds.body_mass=[1,2]",
        "hydra.run.dir=out",
    )
    assert answer == Answer(0, "", "")
    out = command_line.folder / "out"
    assert sorted(path.name for path in out.iterdir()) == ["config.yaml", "result.txt"]
    seen = (out / "result.txt").read_text()
    assert (
        seen == "3 {'pitch/viscous.sigma': 0.5, 'body_mass': None} {'body_mass': (1.0, 2.0)} ('translation/coulomb',)"
    )
    assert yaml.safe_load((out / "config.yaml").read_text())["name"] == "stub"


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("tracking=foo", "tracking: unknown option 'foo'"),
        ("tracking=foo", "mlflow, none"),
        ("sed=1", "configuration: unknown key 'sed'; did you mean seed?"),
        ("+sed=1", "configuration: unknown key 'sed'; did you mean seed?"),
        ("~seed", "configuration: seed is missing"),
        ("seed=???", "configuration: seed is missing"),
        ("seed=a", "seed is 'a', expected a whole number"),
        ("seed=1.5", "seed is 1.5, expected a whole number"),
        ("effects=3", "effects is 3, expected a list"),
        ("seed", "override 'seed': missing EQUAL"),
        ("seed=[1", "override 'seed=[1'"),
        ("seed=1,2", "add --multirun"),
        ("name=???", "name"),
        ("task.behavior=x", "task: unknown key 'behavior'; did you mean behaviour?"),
        ("+task.more=x", "task: unknown key 'more'"),
        ("task.behaviour=1", "task.behaviour is 1, expected a text"),
        ("task.behaviour=???", "task.behaviour is missing; give task.behaviour=VALUE"),
        ("model.pth=x", "model: unknown key 'pth'; did you mean path?"),
        ("free.body_mass=x", "free.body_mass is 'x', expected a number or null"),
        ("bounds.body_mass=[2,1]", "bounds.body_mass is [2, 1], expected [low, high] with low < high"),
        ("bounds.body_mass=[1,2,3]", "bounds.body_mass is [1, 2, 3], expected a list of 2 items"),
        ("task.behaviour=refuse", "r3.csv row 812: t decreases; sort or drop the row"),
    ],
)
def test_a_fault_of_the_user_gets_one_line_status_2_and_leaves_nothing(
    command_line: CommandLine, argument: str, message: str
):
    answer = command_line(argument, "hydra.run.dir=out")
    assert (answer.status, answer.out) == (2, "")
    assert message in answer.error
    assert answer.error.count("\n") == 1
    assert not (command_line.folder / "out").exists()


def test_an_output_folder_that_cannot_be_made_is_the_users_to_mend(command_line: CommandLine):
    (command_line.folder / "file").write_text("")
    answer = command_line("hydra.run.dir=file/out")
    assert answer.status == 2
    assert answer.error.startswith("output folder file/out: Not a directory; choose another with hydra.run.dir=FOLDER")
    assert answer.error.count("\n") == 1


def test_a_full_disk_is_the_users_to_mend():
    error = OSError(errno.ENOSPC, "No space left on device", "runs/a")
    assert explanation(error) == "runs/a: No space left on device; make room, and the same command does the rest"


def test_an_output_folder_that_was_there_before_survives_a_failure(command_line: CommandLine):
    (command_line.folder / "out").mkdir()
    assert command_line("task.behaviour=refuse", "hydra.run.dir=out").status == 2
    assert (command_line.folder / "out").is_dir()


def test_a_defect_shows_where_it_happened(command_line: CommandLine):
    answer = command_line("task.behaviour=break", "hydra.run.dir=out")
    assert answer.status == 1
    assert answer.error.startswith("Traceback")
    assert answer.error.endswith("OSError: defect\n")
    assert not (command_line.folder / "out").exists()


def test_an_interrupted_run_says_so(command_line: CommandLine):
    assert command_line("task.behaviour=interrupt") == Answer(130, "", "interrupted; the run was not finished\n")


@pytest.mark.parametrize("sweep", ["-m", "hydra.mode=MULTIRUN"])
def test_a_sweep_gives_every_job_the_folder_of_its_label(command_line: CommandLine, sweep: str):
    answer = command_line("name=seeds", "label=seed_${seed}", sweep, "seed=1,2")
    assert (answer.status, answer.out) == (0, "")
    results = sorted(
        path.relative_to(command_line.folder).as_posix() for path in command_line.folder.rglob("result.txt")
    )
    assert results == ["runs/seeds/seed_1/result.txt", "runs/seeds/seed_2/result.txt"]


def test_a_failing_job_fails_its_sweep_but_not_the_other_jobs(command_line: CommandLine):
    answer = command_line("-m", "task.behaviour=refuse,succeed")
    assert answer.status == 2
    assert answer.error.endswith("r3.csv row 812: t decreases; sort or drop the row\n")
    assert [path.parent.name for path in command_line.folder.rglob("result.txt")] == ["1"]


@pytest.mark.parametrize("question", ["--help", "--cfg=job"])
def test_questions_are_answered_without_slow_imports(tmp_path: Path, question: str):
    answer = in_a_process(tmp_path, "-c", REPORT_IMPORTS, question)
    assert (answer.status, answer.error) == (0, "")
    assert answer.out.endswith("imported []\n")


def test_the_status_of_the_process_is_that_of_the_run(tmp_path: Path):
    answer = in_a_process(tmp_path, "-m", "wipx", "sed=1")
    assert (answer.status, answer.out) == (2, "")
    assert answer.error.startswith("configuration: unknown key 'sed'; did you mean seed?")


def test_help_is_that_of_hydra(tmp_path: Path):
    assert in_a_process(tmp_path, "-m", "wipx", "--help", "seed=0").out == f"{help_text()}\n"


def test_help_lists_the_groups_and_shows_one_example_of_each_use(command_line: CommandLine):
    text = command_line("--help").out
    assert "tracking: mlflow, none" in text
    for example in ("task=identify", "task=predict", "-m ", "label='${chosen:optimizer}'", "--cfg job"):
        assert example in text
