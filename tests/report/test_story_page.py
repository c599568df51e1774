"""The page of the whole chain: every figure of the story is on it, and it needs nothing beside it."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report.control_results import result

from wipx.core.estimation import EstimationResult, Judged
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.core.story import NamedEffect, SignalError, Story
from wipx.report.story_page import story_in_words, write_story_page

PICTURES = ("diagnosis.png", "estimates.png", "balancing.png", "control.gif")


def estimation(method: str, off: float) -> EstimationResult:
    pitch = np.array([-0.1, 0.0, 0.1])
    judged = Judged(pitch, pitch + off, pitch - 0.05, pitch + 0.05)
    return EstimationResult(method, "cnn1d", 31, 0.015, 0, "emulated", judged, judged, 1e-4, 3.0, {})


@pytest.fixture
def story() -> Story:
    body = {"body_mass": 5.0, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.15}
    plant = plant_of("wip")
    hidden = Model(
        plant,
        plant.complete({**body, "wheel_inertia": 0.0023, "wheel_radius": 0.0625}, "test"),
        {"translation/coulomb": {"F_c": 1.81}},
    )
    return Story(
        target="EmulatedTestbed",
        plant="wip",
        recordings=7,
        held_out=2,
        duration=8.0,
        verdict="mismatch",
        effects=(NamedEffect("translation/coulomb", {"F_c": (1.8, 1.75, 1.85)}, {"F_c": "N"}),),
        horizon=0.5,
        errors=(SignalError("x", 0.04, 0.001, 1e-4), SignalError("theta", 0.1, 0.005, 1e-3)),
        hidden=hidden,
        hidden_signals={"latency": 0.0015, "in_steps": True},
        before=estimation("pure_sim", 0.02),
        after=estimation("diagnosed", 0.002),
        control={
            "balancing": (result("lqr", heavy_stops=True), result("lqr_equilibrium", (0.2, 0.3), off=0.01)),
        },
    )


def written(story: Story, folder: Path) -> str:
    pictures = {}
    for name in PICTURES:
        (folder / name).write_bytes(name.encode())
        pictures[Path(name).stem] = folder / name
    write_story_page(story, pictures, folder / "story.html")
    return (folder / "story.html").read_text(encoding="utf-8")


def test_the_words_have_the_figures_of_every_stage(story: Story):
    words = story_in_words(story)
    assert "Found missing: Coulomb friction on the rail joint." in words
    assert "x 40.0 to 1.00 mm" in words
    assert "20.0 mrad" in words
    assert "2.00 mrad" in words
    assert "0.45 s" in words
    assert "4 of 4 trials without a stop (2 for the baseline)" in words
    assert "smaller by 77 %" in words


def test_the_page_shows_what_was_found_beside_what_was_hidden(story: Story, tmp_path: Path):
    page = written(story, tmp_path)
    assert "F_c = 1.80 N [1.75, 1.85]" in page
    assert "F_c = 1.81" in page
    assert "latency = 0.0015" in page
    assert "emulated testbed" in page
    assert page.count("data:image/png") == 3
    assert page.count("data:image/gif") == 1
    assert "<script" not in page
    assert not re.search(r'(src|href)="(https?:|/)', page)


def test_a_real_robot_hides_nothing_that_could_be_shown(story: Story, tmp_path: Path):
    page = written(replace(story, hidden=None, hidden_signals={}), tmp_path)
    assert "emulated" not in page
    assert "really has" not in page


def test_a_robot_that_lacks_nothing_is_told_so(story: Story):
    assert story_in_words(replace(story, effects=(), verdict="consistent")).startswith("No effect was found missing.")
