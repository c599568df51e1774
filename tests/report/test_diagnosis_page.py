"""The page of a diagnosis says what was found, in words, and takes no text for markup."""

from dataclasses import replace

import numpy as np
import pytest
from report import synthetic, synthetic_diagnosis
from report.test_page import HOSTILE, Elements

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.core.remainder import Unexplained
from wipx.core.results import Estimate
from wipx.report.diagnosis_charts import MOST_RUNS, bar_length, diagnosis_data, force_range
from wipx.report.diagnosis_page import diagnosis_page, write_diagnosis_page

ALL = {
    "mismatch": synthetic_diagnosis.mismatch,
    "consistent": synthetic_diagnosis.consistent,
    "unexplained": synthetic_diagnosis.unexplained,
}


def seen(diagnosis: Diagnosis) -> Elements:
    return Elements(diagnosis_page(diagnosis))


def words(diagnosis: Diagnosis) -> str:
    return " ".join(seen(diagnosis).text.split())


@pytest.mark.parametrize("make", ALL.values(), ids=list(ALL))
def test_page_is_self_contained_and_shows_no_raw_missing_values(make, tmp_path):
    path = tmp_path / "report.html"
    write_diagnosis_page(make(), path)
    elements = Elements(path.read_text(encoding="utf-8"))
    assert elements.links == []
    assert "link" not in elements.tags
    assert elements.tags.count("script") == 3  # data, plotly.js, the page's own
    page_words = elements.text.replace("(", " ").split()
    assert not {"nan", "NaN", "None", "inf", "null"} & set(page_words)
    assert path.stat().st_size < 1.5e6
    assert list(tmp_path.iterdir()) == [path]


def test_small_laws_of_the_model_are_told_and_not_among_what_was_left_out():
    whole = synthetic_diagnosis.mismatch()
    told = words(replace(whole, effects=whole.effects[:1], minor=(replace(whole.effects[1], unnamed="small"),)))
    assert "Also in the completed model" in told
    assert "Also in the completed model" not in words(whole)


def test_laws_that_every_machine_follows_a_little_are_told_apart_from_small_ones():
    whole = synthetic_diagnosis.mismatch()
    friction, delay = whole.effects
    encoder = replace(delay, name="sensor_theta/eccentricity", unnamed="everywhere")
    told = words(replace(whole, effects=(friction,), minor=(replace(delay, unnamed="small"), encoder)))
    assert "Predictions hardly need it" in told
    assert "The model also has eccentricity of the pitch sensor" in told
    assert "Nearly every machine has a little of it" in told
    alone = words(replace(whole, effects=(friction,), minor=(encoder,)))
    assert "Predictions hardly need" not in alone
    assert "Also in the completed model: eccentricity of the pitch sensor" in alone


def test_laws_that_are_not_proven_are_told_as_such():
    whole = synthetic_diagnosis.mismatch()
    friction, delay = whole.effects
    told = words(replace(whole, effects=(friction,), minor=(replace(delay, unnamed="unproven"),)))
    assert "Also in the completed model" in told
    assert "Predictions are better with it, but that may be chance, or the work of other effects." in told


def test_page_of_a_mismatch_says_what_where_how_sure_and_what_next():
    text = words(synthetic_diagnosis.mismatch())
    for part in (
        "Mismatch: physics is missing",
        "Coulomb friction of 3.10 N on the rail joint and a delay of 4.1 ms of the actuator are missing.",
        "Coulomb friction on the rail joint",
        "translation/coulomb",
        "-F_c s(v), any force in [-F_c, F_c] at v = 0",
        "3.10 N [2.93, 3.29]",
        "First-order lag of the actuator",
        "> 99.9 %",
        "71 % of the excess error lies where x_dot is between -0.1 and 0.1 m/s.",
        "98 % of the excess error of r3.csv lies at times between 4.9 and 10 s.",
        "adds 0.7 nats for two more numbers",
        "of the body about its CoM",
        "environment/rail_tilt.angle",
        "Nothing significant is left over (p = 0.31)",
        "Is it a delay or a lag of the actuator?",
        "no motion faster than 0.8 m/s",
        "Time steps of r2.csv jitter by 12 %.",
    ):
        assert part in text


def test_what_was_asked_stands_behind_the_answer():
    text = words(synthetic_diagnosis.asked())
    assert "What was asked" not in words(synthetic_diagnosis.mismatch())
    assert text.index("What was left out") < text.index("What was asked") < text.index("Recorded and predicted")
    for part in ("3.10 N [2.93, 3.29]", "pitch/viscous", "It agrees.", "It is excluded."):
        assert part in text[text.index("What was asked") :]


def test_parts_stand_in_the_order_of_the_questions():
    text = words(synthetic_diagnosis.mismatch())
    titles = (
        "What was left out",
        "Recorded and predicted",
        "Prediction errors Root",
        "Where the mismatch is",
        "Laws on the data",
        "Evidence Log-likelihood",
        "Numbers behind the answer",
        "What is unexplained",
        "What to record next",
        "How this was obtained",
    )
    places = [text.index(title) for title in titles]
    assert places == sorted(places)


def test_page_of_a_consistent_robot_says_so_and_leaves_empty_parts_out():
    text = words(synthetic_diagnosis.consistent())
    assert "Nothing is missing: the nominal model explains these recordings" in text
    assert "Where the mismatch is" not in text
    assert "Laws on the data" not in text
    assert "Ties and rivals" not in text


def test_page_of_the_unexplained_names_place_shape_and_look_alikes():
    whole = synthetic_diagnosis.unexplained()
    text = words(whole)
    assert "Unexplained: known effects are not enough" in text
    assert "left over at the rail joint (p < 0.0001)" in text
    assert "a force over x" in text
    assert "load-dependent gear friction on the rail joint" in text
    assert [curve["standIn"] for curve in diagnosis_data(whole)["curves"]] == [False, True]


def test_hostile_texts_stay_text():
    whole = synthetic_diagnosis.mismatch()
    where = whole.location.map
    assert where is not None
    effect = replace(whole.effects[0], law=HOSTILE, source=HOSTILE)
    hostile = replace(
        whole,
        title=HOSTILE,
        source=HOSTILE,
        sentence=HOSTILE,
        effects=(effect,),
        location=replace(
            whole.location,
            map=replace(where, runs=(HOSTILE,) * len(where.runs)),
            times=(replace(whole.location.times[0], recording=HOSTILE),),
        ),
        candidates=(replace(whole.candidates[0], name=HOSTILE, reason=HOSTILE),),
        weak=(HOSTILE,),
        notes=(HOSTILE,),
        traces=(replace(whole.traces[0], name=HOSTILE),),
    )
    elements = seen(hostile)
    assert elements.tags.count("script") == 3
    assert HOSTILE in elements.text


def test_unknown_numbers_are_written_in_words():
    whole = synthetic_diagnosis.mismatch()
    number = Estimate("actuator/delay.tau", "s", 0.0, 0.004, -np.inf, np.inf, True, "delay")
    effect = replace(whole.effects[1], parameters=(number,), heldout_gain=np.nan, present_probability=np.nan)
    unknown = replace(whole, effects=(effect,), unexplained=Unexplained(False, np.nan, None, "", (), None))
    text = words(unknown)
    assert "(not determined)" in text
    assert "at a bound of the search" in text
    assert "Nothing significant is left over." in text


def test_nothing_held_out_and_no_traces_still_make_a_page():
    whole = synthetic_diagnosis.mismatch()
    bare = replace(whole, held_out=replace(whole.held_out, windows=0), traces=(), candidates=(), bounds=())
    assert "none were held out" in words(bare)


def test_effects_that_are_absent_leave_a_plain_sentence():
    whole = replace(synthetic_diagnosis.unexplained(), effects=())
    assert "No effect of the vocabulary was found" in words(whole)


def test_only_the_recordings_with_the_largest_excess_become_strips():
    whole = synthetic_diagnosis.mismatch()
    where = whole.location.map
    assert where is not None
    runs = tuple(f"r{i}.csv" for i in range(30))
    times, along = (np.array([0.5, 1.5]),) * 30, tuple(np.full(2, float(i)) for i in range(30))
    many = replace(whole, location=replace(whole.location, map=replace(where, runs=runs, times=times, along=along)))
    assert diagnosis_data(many)["strips"]["runs"] == list(runs[-MOST_RUNS:])
    assert f"{30 - MOST_RUNS} recordings with less excess error are not shown" in words(many)


def test_bars_grow_with_the_gain_and_vanish_without_one():
    lengths = [bar_length(gain, 100.0) for gain in (np.nan, -3.0, 0.0, 1.0, 10.0, 100.0)]
    assert lengths == sorted(lengths)
    assert lengths[:3] == [0.0, 0.0, 0.0]
    assert lengths[-1] == 1.0


def test_range_of_a_law_shows_law_data_and_zero():
    curve = synthetic_diagnosis.law_curve()
    low, high = force_range(replace(curve, force=np.full(len(curve.bins), np.nan)))
    assert low < -3.1 < 0.0 < 3.1 < high


@pytest.mark.parametrize("units", [synthetic.UNITS, synthetic.DOUBLE_PENDULUM_UNITS])
def test_every_signal_is_drawn(units):
    shown = replace(
        synthetic_diagnosis.mismatch(), units=units, traces=(synthetic.trace("r.csv", held_out=True, units=units),)
    )
    drawn = diagnosis_data(shown)["traces"][0]
    assert [part["name"] for part in (*drawn["signals"], *drawn["commands"])] == list(units)


def test_a_folder_that_does_not_exist_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"missing.*choose a writable folder"):
        write_diagnosis_page(synthetic_diagnosis.mismatch(), tmp_path / "missing" / "report.html")
