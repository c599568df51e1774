"""Figures and the moving picture of controllers under loads."""

from pathlib import Path

import pytest
from PIL import Image, ImageSequence
from report.control_results import result

from wipx.report.control_animation import LONGEST, PICTURES, animate
from wipx.report.control_figures import draw_errors


def test_errors_of_all_loads_are_drawn(tmp_path: Path):
    path = tmp_path / "errors.png"
    draw_errors([result("lqr", heavy_stops=True), result("lqr_equilibrium", (0.2, 0.3), off=0.0)], path)
    with Image.open(path) as picture:
        assert min(picture.size) > 500


@pytest.mark.slow
def test_the_moving_picture_is_small_and_lasts_as_long_as_the_motion(tmp_path: Path):
    path = tmp_path / "control.gif"
    animate([result("lqr", heavy_stops=True), result("lqr_equilibrium", (0.2, 0.3), off=0.0)], "b5", path)
    assert path.stat().st_size < 3e6
    with Image.open(path) as film:
        seconds = 0.0
        for picture in ImageSequence.Iterator(film):
            seconds += 1e-3 * picture.info["duration"]
        # Pictures that are the same as the one before are joined.
        assert seconds == pytest.approx(LONGEST, abs=1.5 / PICTURES)
