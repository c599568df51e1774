"""The page opens without a network, shows every figure, and takes no text for markup."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from report import synthetic

from wipx.core.errors import InputError
from wipx.core.results import IdentificationResult, SearchHistory
from wipx.report.charts import MISSING, MOST_TRACES, chart_data, rounded
from wipx.report.page import page, write_page

HOSTILE = "</script><script>alert(1)</script>"


class Elements(HTMLParser):
    """Collects what a browser would see as elements and as text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.text = ""
        self.scripts: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data):
        if self.tags[-1:] == ["script"] and self.scripts[-1] == "":
            self.scripts[-1] = data
        else:
            self.text += data


def seen(result: IdentificationResult) -> Elements:
    return Elements(page(result))


def test_page_is_self_contained_and_small(tmp_path):
    path = tmp_path / "report.html"
    write_page(synthetic.result(), path)
    elements = Elements(path.read_text(encoding="utf-8"))
    assert elements.links == []
    assert "link" not in elements.tags
    assert "@import" not in elements.text
    assert elements.tags.count("script") == 3  # data, plotly.js, the page's own
    assert path.stat().st_size < 1.5e6
    assert list(tmp_path.iterdir()) == [path]


def test_page_states_the_outcome_and_everything_behind_it():
    text = seen(synthetic.result()).text
    for words in (
        "on held-out recordings: x 21.0 → 2.10 mm, theta 33.6 → 3.36 mrad",
        "translation/coulomb.F_c",
        "[2.93, 3.29]",
        "-F_c s(v), sticking at v = 0",
        "Olsson et al. 1998",
        "body_mass",
        "every third recording held out",
        "Huber loss",
        "widen it or drop the effect",
        "r3.csv (held-out)",
        "1800 evaluations",
    ):
        assert words in text


def test_held_out_recordings_come_first():
    text = seen(synthetic.result()).text
    assert text.index("r3.csv") < text.index("r1.csv")


@pytest.mark.parametrize("units", [{"x": "m", "u": "N"}, synthetic.UNITS, synthetic.DOUBLE_PENDULUM_UNITS])
def test_every_signal_and_command_is_drawn(units):
    shown = chart_data(synthetic.result(units))["traces"][0]
    drawn = [part["name"] for part in (*shown["signals"], *shown["commands"])]
    assert drawn == list(units)


def test_hostile_texts_stay_text():
    whole = synthetic.result({HOSTILE: "m", "u": "N"})
    hostile = replace(
        whole,
        title=HOSTILE,
        source=HOSTILE,
        split=HOSTILE,
        effects=((HOSTILE, HOSTILE, HOSTILE),),
        estimates=(replace(whole.estimates[3], name=HOSTILE, meaning=HOSTILE, unit=HOSTILE),),
        nominal=((HOSTILE, 1.0, HOSTILE),),
        traces=(replace(whole.traces[0], name=HOSTILE),),
        notes=(HOSTILE,),
    )
    elements = seen(hostile)
    assert elements.tags.count("script") == 3
    assert HOSTILE in elements.text
    assert json.loads(elements.scripts[0])["traces"][0]["signals"][0]["name"] == HOSTILE


def test_data_holds_what_was_recorded():
    whole = synthetic.with_trace(synthetic.trace("r.csv", held_out=True))
    packed = json.loads(seen(whole).scripts[0])["traces"][0]
    t = np.frombuffer(base64.b64decode(packed["t"]), "<f4")
    assert np.isclose(t[-1], whole.traces[0].t[-1])
    signal = packed["signals"][0]
    completed = unrounded(signal["completed"])
    assert np.isnan(completed).sum() == len(whole.traces[0].starts) - 1


def test_series_are_rounded_to_a_share_of_their_range(fresh_seed):
    values = np.random.default_rng(fresh_seed).normal(size=1000)
    values[7] = np.nan
    assert np.allclose(unrounded(rounded(values)), values, rtol=0.0, atol=1e-5 * np.ptp(values[8:]), equal_nan=True)
    constant = np.array([2.5, np.nan, 2.5])
    assert np.array_equal(unrounded(rounded(constant)), constant, equal_nan=True)


def test_a_prediction_that_runs_away_is_still_drawn_where_it_did_not():
    whole = synthetic.trace("r.csv", held_out=True)
    away = {name: values.copy() for name, values in whole.nominal.items()}
    for values in away.values():
        values[-1] = 1e300
    drawn = json.loads(seen(synthetic.with_trace(replace(whole, nominal=away))).scripts[0])["traces"][0]
    usual = json.loads(seen(synthetic.with_trace(whole)).scripts[0])["traces"][0]
    for signal, other in zip(drawn["signals"], usual["signals"], strict=True):
        span = np.ptp(whole.recorded[signal["name"]])
        before, after = (unrounded(each["nominal"])[:-1] for each in (other, signal))
        assert np.allclose(before, after, rtol=0.0, atol=1e-3 * span, equal_nan=True)


def unrounded(series: dict) -> np.ndarray:
    steps = np.frombuffer(base64.b64decode(series["steps"]), "<u2")
    return np.where(steps == MISSING, np.nan, series["low"] + series["step"] * steps)


def test_long_recordings_are_thinned_and_the_page_says_so():
    long = synthetic.trace("long.csv", held_out=True, rows=40_000, rate=650.0)
    html = page(synthetic.with_trace(long))
    assert len(html) < 1.5e6
    assert re.search(r"Drawn with \d{4} of 40000 rows", html)


def test_many_long_recordings_stay_below_the_size_limit():
    many = tuple(
        synthetic.trace(f"r{i}.csv", held_out=i > 9, units=synthetic.DOUBLE_PENDULUM_UNITS, rows=20_000)
        for i in range(30)
    )
    html = page(replace(synthetic.result(synthetic.DOUBLE_PENDULUM_UNITS), traces=many))
    assert len(html) < 1.5e6
    assert f"{30 - MOST_TRACES} more recordings are not shown" in html


def test_nothing_held_out_no_traces_no_search_still_make_a_page():
    empty = SearchHistory("none", np.array([]), np.array([]), np.array([]), "interrupted")
    bare = replace(synthetic.without_held_out(), traces=(), estimates=(), effects=(), history=empty, notes=())
    text = seen(bare).text
    assert "none were held out" in text
    assert "the nominal model was left as it is" in text


def test_failed_predictions_are_shown_as_such():
    failed = replace(synthetic.result().fit, nominal={"x": np.inf, "theta": 0.03}, noise_floor={})
    text = seen(replace(synthetic.result(), held_out=failed)).text
    assert "nominal model fails to predict" in text


def test_a_folder_that_does_not_exist_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"missing.*choose a writable folder"):
        write_page(synthetic.result(), tmp_path / "missing" / "report.html")
