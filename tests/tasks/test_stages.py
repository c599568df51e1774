"""Stages of a chain: commands in folders of their own, run once, refused in one line."""

from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.tasks.shared.stages import Chain, Stage


def figure(name: str = "figure", *more: str) -> Stage:
    return Stage(name, ("task=friction_figure", "tracking=none", *more), 0.25)


@pytest.fixture
def said() -> list[tuple[str, float]]:
    return []


@pytest.fixture
def chain(tmp_path: Path, said: list[tuple[str, float]]) -> Chain:
    return Chain(tmp_path, lambda stage, share: said.append((stage, share)))


def test_a_stage_leaves_its_results_its_command_and_its_words(chain: Chain, said: list[tuple[str, float]]):
    chain.run(figure(), figure("other"))
    for name in ("figure", "other"):
        folder = chain.out / name
        assert (folder / "friction.csv").is_file()
        assert "python -m wipx task=friction_figure" in (folder / "command.txt").read_text()
        assert (folder / "log.txt").is_file()
    assert said[0] == ("figure and other", 0.0) or said[0] == ("figure", 0.0)
    assert said[-1] == ("", 0.5)


@pytest.mark.slow
def test_a_finished_stage_is_not_repeated_and_one_of_another_command_is_refused(chain: Chain):
    chain.run(figure())
    written = (chain.out / "figure" / "friction.csv").stat().st_mtime_ns
    chain.run(figure())
    assert (chain.out / "figure" / "friction.csv").stat().st_mtime_ns == written
    with pytest.raises(InputError, match="made by another command"):
        chain.run(figure("figure", "seed=3"))


def test_what_a_stage_refuses_is_told_with_its_name(chain: Chain):
    with pytest.raises(InputError, match=r"stage figure: .*nonsense"):
        chain.run(figure("figure", "task.nonsense=1"))
    assert not (chain.out / "figure" / "config.yaml").exists()
