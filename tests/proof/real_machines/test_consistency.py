"""`task=real_consistency`: diagnoses of disjoint groups of runs of one machine, side by side."""

from dataclasses import replace
from pathlib import Path

import pytest
from diagnosis.recorded import recorded, write_folder

from wipx.core.sizes import Size
from wipx.proof.baseline_answers import MethodAnswer, NamedEffect
from wipx.proof.real_machines import consistency
from wipx.proof.real_machines.consistency_table import markdown, size_series
from wipx.proof.real_machines.group_results import OURS, GroupResult, read_group, write_group
from wipx.proof.real_machines.published import Published
from wipx.recordings.source import RecordingSource

RESULTS = {"group.json", "diagnosis.json", "model.yaml", "identified.yaml", "report.html", "diagnosis.png"}
PUBLISHED = Published(
    {"translation/coulomb": "F_c = 0.5 N"}, main={"translation/coulomb": ["stribeck"]}, authors={"effects": {}}
)


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four runs of an axis with Coulomb friction of 0.5 N; no test changes it."""
    recordings = recorded("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, seed=21, count=4)
    return write_folder(tmp_path_factory.mktemp("rig") / "axis", "linear_axis", recordings, ("t", "x", "u"))


def settings(folder: Path, *others: str) -> tuple[str, ...]:
    """Arguments for a rig of its own, in two groups of two runs."""
    source = f"{{_target_: wipx.recordings.source.RecordingSource, path: '{folder}', title: Axis}}"
    known = "{translation/coulomb: 'F_c = 0.5 N'}"
    authors = "{effects: {translation/coulomb: {F_c: 0.5}}}"
    published = f"{{known: {known}, main: {{translation/coulomb: [stribeck]}}, authors: {authors}}}"
    rig = f"{{dataset: own, ways: {{pairs: {{blocks: 2}}}}, published: {published}}}"
    return (
        "+experiment=real_consistency",
        f"+task.sources.own={source}",
        f"+task.rigs.own={rig}",
        "task.only=[own]",
        "sim.threads=1",
        "hydra.run.dir=out",
        *others,
    )


def size(value: float, half: float) -> Size:
    return Size("translation/coulomb", "F_c", value, value - half, value + half, "N")


def result(group: str, *sizes: Size, method: str = OURS, error: float = 0.01) -> GroupResult:
    named = tuple(NamedEffect(one.effect) for one in sizes)
    answers = {method: MethodAnswer(method, named, {"x": error}, 3.0)}
    errors = {"nominal": {"x": 0.02}, "identified": {"x": 0.005}, "authors": {"x": 0.015}}
    return GroupResult("own", "pairs", group, ("a.csv",), "mismatch", answers, sizes, errors, {"x": "m"})


def test_sizes_agree_where_their_difference_is_within_both_intervals():
    assert size(1.0, 0.3).agrees(size(1.49, 0.4))
    assert not size(1.0, 0.3).agrees(size(1.51, 0.4))
    assert size(1.49, 0.4).agrees(size(1.0, 0.3))


def test_a_size_without_an_interval_agrees_with_nothing():
    assert not size(1.0, float("nan")).agrees(size(1.0, 0.4))


def test_a_result_is_read_back_as_it_was_written(tmp_path: Path):
    one = result("group01", size(0.5, 0.1))
    write_group(one, {"seed": 0}, tmp_path)
    assert read_group({"seed": 0}, tmp_path) == one
    assert read_group({"seed": 1}, tmp_path) is None
    assert read_group({"seed": 0}, tmp_path / "nowhere") is None


def test_the_tables_count_names_errors_and_agreements():
    results = [result("group01", size(0.5, 0.1)), result("group02", size(0.9, 0.1)), result("group03", error=0.03)]
    table = markdown(results, {"own": ("Axis", PUBLISHED)})
    assert "| Axis | wipx | 3 | 2 | 0 | 0 | 1 | 0 |" in table
    assert "| Axis | x | 3 | 0.02 m | 0.01 m | 0.005 m | 0.015 m | - |" in table
    assert "| Axis | translation/coulomb | main | 2 | 3 | F_c | 0.700 N | 0.500 N | 0.900 N | 0 of 1 |" in table
    assert "| groups with every main effect named | wipx | 2 of 3 |" in table
    assert "| groups that predict worse than the nominal model | wipx | 1 of 3 |" in table
    assert "| error over that of identify, told the names: worst | wipx | 6.00 |" in table


def test_the_figure_shows_known_effects_first_beside_the_authors_figure():
    other = Size("actuator/delay", "tau", 0.01, 0.0, 0.02, "s")
    published = replace(PUBLISHED, authors={"effects": {"translation/coulomb": {"F_c": 0.5}}})
    results = [result("group01", other, size(0.5, 0.1)), result("group02", other)]
    first, second = size_series(results, {"own": ("Axis", published)})
    assert (first.rig, first.ways, first.sizes, first.published) == ("Axis", ("pairs",), (size(0.5, 0.1),), 0.5)
    assert (second.sizes, second.published) == ((other, other), None)


@pytest.mark.slow
def test_each_group_is_diagnosed_and_predicts_the_others(program, axis: Path, tmp_path: Path):
    answer = program(*settings(axis))
    assert (answer.status, answer.error) == (0, "")
    out = tmp_path / "out"
    for group in ("group01", "group02"):
        assert {path.name for path in (out / "own" / "pairs" / group).iterdir()} >= RESULTS
    assert "| Axis | wipx | 2 | 2 | 0 | 0 | 0 | 0 |" in (out / "table.md").read_text()
    assert "| groups that predict worse than the nominal model | wipx | 0 of 2 |" in (out / "table.md").read_text()
    assert (out / "sizes.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_group_that_is_done_is_only_given_to_methods_that_are_missing(
    program, axis: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table: begin -->\nold\n<!-- table: end -->\nafter\n")
    done: list[str] = []

    def diagnosed(_: object, group: consistency.Group, *__: object) -> GroupResult:
        done.append(group.name)
        return result(group.name, size(0.5, 0.1))

    monkeypatch.setattr(consistency, "_diagnosed", diagnosed)
    assert program(*settings(axis)).status == 0
    baselines = ("task.baselines=[regression]", "task.methods.regression.seconds=2")
    answer = program(*settings(axis, *baselines, f"task.page={page}"))
    assert (answer.status, answer.error) == (0, "")
    assert done == ["group01", "group02"]
    for row in ("| Axis | wipx | 2 | 2 | 0 | 0 | 0 | 0 |", "| Axis | regression | 2 |"):
        assert row in page.read_text()
    assert "\nold\n" not in page.read_text()
    assert program(*settings(axis, "seed=1")).status == 0
    assert len(done) == 4  # another seed is another question


def test_an_interrupted_run_leaves_the_table_of_what_is_done(
    program, axis: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def interrupted(*arguments: object) -> GroupResult:
        group = arguments[1]
        assert isinstance(group, consistency.Group)
        if group.name == "group02":
            raise KeyboardInterrupt
        return result(group.name, size(0.5, 0.1))

    monkeypatch.setattr(consistency, "_diagnosed", interrupted)
    answer = program(*settings(axis))
    assert answer.status == 130
    assert "| Axis | wipx | 1 | 1 |" in (tmp_path / "out" / "table.md").read_text()
    assert "1 of 2 groups are done" in answer.out


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("task.only=[bamm]", "did you mean bam?"),
        ("task.baselines=[regresion]", "did you mean regression?"),
        ("task.groups=0", "task.groups is 0"),
        ("task.page=nowhere.md", "there is no file nowhere.md"),
    ],
)
def test_a_faulty_setting_is_refused_in_one_line(program, argument: str, said: str):
    answer = program("+experiment=real_consistency", argument, "hydra.run.dir=out")
    assert answer.status == 2
    assert said in answer.error
    assert len(answer.error.strip().splitlines()) == 1


def test_missing_recordings_are_named_in_one_line(program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("WIPX_RECORDINGS", str(tmp_path / "nowhere"))
    answer = program("+experiment=real_consistency", "hydra.run.dir=out")
    assert answer.status == 2
    assert len(answer.error.strip().splitlines()) == 1
    for part in ("disk_2024*.csv", "visible/*.csv", "github.com/Rhoban/bam", "WIPX_RECORDINGS=FOLDER"):
        assert part in answer.error


def test_every_rig_at_hand_is_divided_into_disjoint_groups(
    program, recordings_root: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("WIPX_RECORDINGS", str(recordings_root))
    seen: list[consistency.Group] = []

    def noted(_: object, group: consistency.Group, *__: object) -> GroupResult:
        seen.append(group)
        return replace(result(group.name), rig=group.rig)

    monkeypatch.setattr(consistency, "_diagnosed", noted)
    answer = program("+experiment=real_consistency", "profile=consistency_full", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert len({group.rig for group in seen}) == 10
    for group in seen:
        mine, others = {one.name for one in group.source.load()}, {one.name for one in group.others}
        assert mine
        assert others
        assert mine.isdisjoint(others)
        assert isinstance(group.source, RecordingSource)
