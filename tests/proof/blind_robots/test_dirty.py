"""Dirty robots: as much dirt as is stated, the same from the same seed, sealed, and readable."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wipx.proof.blind.reference import best_fit
from wipx.proof.blind_robots import dirty
from wipx.proof.blind_robots.blemishes import Blemishes, blemished, draw_blemishes
from wipx.proof.blind_robots.cases import Case, Choice, realise
from wipx.proof.blind_robots.dirt import LARGEST, draw_dirt, draw_waves
from wipx.proof.blind_robots.dirty import OVER_DIRT, OWN, SHARE, draw_dirty, realise_dirty
from wipx.proof.blind_robots.foresight import foretell, shown
from wipx.proof.blind_robots.logging import Run, drive, record
from wipx.proof.blind_robots.physics import Hidden, physics
from wipx.proof.blind_robots.robots import draw_robot
from wipx.proof.blind_robots.scenario import draw_log_settings, draw_scenario
from wipx.proof.blind_robots.seal import seal, unseal
from wipx.proof.blind_robots.sizes import Draw, consequences
from wipx.proof.blind_robots.write import case_files, write_files
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator

LENGTHS = (4.0, 4.5)
FRICTION = ("translation/viscous",)


def drawn(tier: str, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    attempts = (realise_dirty(tier, "linear_axis", FRICTION, rng, LENGTHS) for _ in range(60))
    return next(case for case in attempts if case is not None)


@pytest.fixture(scope="module")
def case() -> Case:
    return drawn("dirty", 5)


@pytest.fixture(scope="module")
def dirt_only() -> Case:
    return drawn("dirt_only", 6)


def has_the_share_that_was_asked_for(case: Case) -> bool:
    assert case.dirt is not None
    return SHARE[0] <= case.dirt["share"] <= SHARE[1] and case.dirt["scale"] <= LARGEST


@pytest.mark.slow
def test_the_dirt_has_the_share_that_was_asked_for(case: Case, dirt_only: Case):
    assert has_the_share_that_was_asked_for(case)
    assert has_the_share_that_was_asked_for(dirt_only)


@pytest.mark.slow
@pytest.mark.parametrize("tier", ["dirty", "dirt_only"])
def test_the_dirt_of_any_robot_has_the_share_that_was_asked_for(tier: str, fresh_seed: int):
    assert has_the_share_that_was_asked_for(drawn(tier, fresh_seed))


def test_more_dirt_makes_more_error(monkeypatch: pytest.MonkeyPatch):
    seen: list[tuple[float, float]] = []
    measure = dirty.prediction_errors

    def both(machine, there, scale):
        errors = measure(machine, there, scale)
        if errors is not None and scale > 0.0:
            half = measure(machine, there, 0.5 * scale)
            assert half is not None
            seen.append((half.dirt, errors.dirt))
        return errors

    monkeypatch.setattr(dirty, "prediction_errors", both)
    drawn("dirty", 5)
    assert seen
    # a quarter where errors add up in proportion; friction that stops a joint does not
    assert all(half < 0.7 * whole for half, whole in seen)


def test_every_dominant_effect_matters(case: Case):
    assert case.dirt is not None
    shares = case.dirt["own_shares"]
    assert set(shares) == set(FRICTION)
    assert all(share >= max(OWN, OVER_DIRT * SHARE[0]) for share in shares.values())


@pytest.mark.slow
def test_a_robot_with_dirt_only_has_nothing_to_be_named(dirt_only: Case):
    assert dirt_only.hidden.effects == {}
    assert dirt_only.dirt is not None
    assert dirt_only.dirt["names"]
    assert "imagined" in dirt_only.dirt
    assert case_files(dirt_only).truth["effects"] == []


def test_a_seed_gives_the_same_dirt(case: Case):
    again = drawn("dirty", 5)
    assert again.dirt == case.dirt
    for first, second in zip((*case.visible, *case.unseen), (*again.visible, *again.unseen), strict=True):
        for name in first.columns:
            assert np.array_equal(first.columns[name], second.columns[name])


def test_dirt_is_sealed_and_not_in_what_a_diagnosis_reads(case: Case, tmp_path: Path):
    files = case_files(case)
    sealed = seal("case0001", files.visible, {"truth": files.truth, "unseen": files.unseen})
    (tmp_path / "case0001.seal").write_bytes(sealed.token)
    truth = unseal(tmp_path / "case0001.seal", sealed.key, sealed.commitment)["truth"]
    assert case.dirt is not None
    assert truth["dirt"]["names"] == case.dirt["names"]
    assert truth["known"] == list(case.known)
    robot = files.visible["robot.yaml"]
    assert not any(word in robot for word in ("dirt", "share", "wander", "uncertainty"))


@pytest.mark.parametrize("part", ["visible", "unseen"])
def test_written_recordings_keep_to_the_contract(case: Case, part: str, tmp_path: Path):
    write_files(tmp_path, getattr(case_files(case), part))
    source = RecordingSource(path=str(tmp_path))
    assert source.describe().model.plant.kind == "linear_axis"
    for recording in source.load():
        assert (np.diff(recording.t) > 0.0).all()
        assert np.isfinite(recording["x"]).all()
        assert np.isfinite(recording["u"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("tier", ["dirty", "dirt_only"])
def test_robots_of_every_plant_are_read(tier: str, tmp_path: Path, fresh_seed: int):
    files = case_files(draw_dirty(np.random.default_rng(fresh_seed), tier, LENGTHS))
    write_files(tmp_path, files.visible)
    assert RecordingSource(path=str(tmp_path)).load()


@pytest.mark.parametrize("kind", ["wip", "double_pendulum"])
def test_the_true_physics_predicts_its_own_run(kind: str):
    rng = np.random.default_rng(3)
    robot, settings = draw_robot(kind, rng), replace(draw_log_settings(kind, rng, poor=False), jitter=0.0)
    joint = "joint1" if kind == "double_pendulum" else "translation"
    hidden = Hidden({f"{joint}/viscous": {"sigma": 0.3}, "actuator/lag": {"tau": 0.02}})
    scenario = draw_scenario(robot, settings, "multisine", rng, LENGTHS)
    truth = physics(kind, robot.parameters, hidden)
    course = drive(robot, truth, scenario, settings)
    assert not course.fell
    seen = shown(truth, course, scenario)
    lacking = physics(kind, robot.parameters, hidden.without(f"{joint}/viscous"))
    assert foretell(truth, truth, course, scenario).difference(seen).max() < 1e-16  # rounding of two integrations
    assert foretell(lacking, truth, course, scenario).difference(seen).max() > 1e-10


def test_friction_that_wanders_by_nothing_is_friction():
    rng = np.random.default_rng(4)
    robot, settings = draw_robot("linear_axis", rng), draw_log_settings("linear_axis", rng, poor=False)
    scenario = draw_scenario(robot, settings, "sine", rng, LENGTHS)
    scenario = replace(scenario, waves=draw_waves(scenario, rng))
    effects = {"translation/coulomb": {"F_c": 0.3}}
    exact = record(robot, physics("linear_axis", robot.parameters, Hidden(effects)), scenario, settings)
    calm = physics("linear_axis", robot.parameters, Hidden(effects))
    calm["uneven_friction"] = 1
    rough = physics("linear_axis", robot.parameters, Hidden(effects, dirt={"wander": {0: 0.2}}))
    np.testing.assert_array_equal(record(robot, calm, scenario, settings).columns["x"], exact.columns["x"])
    assert np.abs(record(robot, rough, scenario, settings).columns["x"] - exact.columns["x"]).max() > 0.0


def test_sizes_of_dirt_stay_within_what_is_told(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    robot, settings = draw_robot("wip", rng), draw_log_settings("wip", rng, poor=False)
    for _ in range(20):
        scenario = draw_scenario(robot, settings, "sine", rng, LENGTHS)
        run = record(robot, physics("wip", robot.parameters, Hidden()), scenario, settings)
        if not run.fell:
            break
    draw = Draw(robot, consequences(robot, (run,)), rng, weak=False)
    known = {"translation/stribeck": {"F_c": 0.1, "F_s": 0.2, "v_s": 0.1}}
    for _ in range(50):
        dirt = draw_dirt(known, (), draw)
        fields = dirt.fields(LARGEST)
        assert len(set(dirt.names)) >= 3
        assert all(abs(error) * LARGEST <= 0.02 for error in dirt.errors.values())
        for name, most in (("wander", 0.25), ("wander_place", 0.25), ("wander_load", 0.25), ("uneven", 0.075)):
            sizes = fields.get(name, {})
            assert isinstance(sizes, Mapping)
            assert all(abs(size) <= most + 1e-12 for size in sizes.values())
        assert set(fields) <= set(physics("wip", robot.parameters, Hidden()).dtype.names or ())


def test_waves_have_unit_size_and_memory():
    rng = np.random.default_rng(9)
    robot, settings = draw_robot("wip", rng), draw_log_settings("wip", rng, poor=False)
    scenario = draw_scenario(robot, settings, "sine", rng, (59.0, 60.0))
    waves = draw_waves(scenario, rng)
    assert waves.std(axis=0) == pytest.approx(1.0, abs=0.35)  # few independent values of a slow process
    assert all(np.corrcoef(wave[1:], wave[:-1])[0, 1] > 0.8 for wave in waves.T)


def test_a_blemished_log_is_late_repeats_and_glitches():
    t = np.arange(4000) * 0.005
    columns = {"t": t, "x": np.sin(t), "u": np.cos(t), "x_dot": np.cos(t)}
    run = Run(columns, {}, {}, fell=False)
    faults = Blemishes(smoothing=0.01, late=0.01, repeated=0.02, outliers=0.002, outlier_size=0.5)
    worse = blemished(run, "linear_axis", faults, np.random.default_rng(1)).columns
    np.testing.assert_array_equal(worse["t"], t)
    np.testing.assert_array_equal(worse["u"], columns["u"])
    assert 0.01 < np.mean(np.diff(worse["x"]) == 0.0) < 0.04
    assert 1 <= np.sum(np.abs(worse["x"] - np.sin(t)) > 0.1) < 30
    # a filter of 10 ms and a delay of 10 ms together are 20 ms late
    late = np.median(np.abs(worse["x_dot"] - np.cos(t - 0.02))[200:])
    assert late < 1e-3 < np.median(np.abs(worse["x_dot"] - np.cos(t))[200:])
    clean = blemished(run, "linear_axis", Blemishes(), np.random.default_rng(1)).columns
    np.testing.assert_allclose(clean["x"], columns["x"], atol=1e-5)


def test_some_logs_have_no_blemish():
    drawn = [draw_blemishes(np.random.default_rng(seed)) for seed in range(40)]
    assert any(one.names == () for one in drawn)
    assert {name for one in drawn for name in one.names} == {"late rates", "repeated rows", "glitches"}


def test_the_reference_finds_the_values_that_predict_best(tmp_path: Path):
    rng = np.random.default_rng(2)
    choice = Choice("single_clear", "linear_axis", FRICTION)
    case = next(case for case in (realise(choice, rng, LENGTHS) for _ in range(30)) if case is not None)
    write_files(tmp_path, case_files(case).visible)
    source = RecordingSource(path=str(tmp_path))
    nominal = source.describe().model
    true = case.hidden.effects[FRICTION[0]]["sigma"]
    simulator = AnalyticSimulator(threads=1)
    found = best_fit(nominal, {FRICTION[0]: {"sigma": 1.3 * true}}, source.load(), simulator)
    assert found.effects[FRICTION[0]]["sigma"] == pytest.approx(true, rel=0.03)  # noise of a few seconds of recordings
    assert best_fit(nominal, {}, source.load(), simulator) == nominal
