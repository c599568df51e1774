"""task=control: what robots are asked to do, how it is judged, and tables that are refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from report.control_results import result
from tasks.conftest import Program

from wipx.app import configuration_folder
from wipx.config import build
from wipx.control.lqr import Lqr
from wipx.core.control_result import FALL, RAIL_END
from wipx.core.errors import InputError
from wipx.core.load import BALANCE, Load
from wipx.core.recording import Recording
from wipx.hardware.push import pushed
from wipx.hardware.target import LoadChange, Push, Trial
from wipx.hardware.testbed import EmulatedTestbed
from wipx.tasks.files.control import plain_control, read_control, write_courses
from wipx.tasks.files.results import write_json
from wipx.tasks.shared.control_metrics import TrialJudge, settled
from wipx.tasks.shared.control_scenarios import SCENARIOS
from wipx.tasks.tables.control import by_scenario


@pytest.fixture(scope="module")
def bed() -> EmulatedTestbed:
    """The testbed that ships, on the engine that is the fastest for one robot, without chance in the release."""
    node = yaml.safe_load((configuration_folder() / "target" / "emulated.yaml").read_text())
    del node["defaults"]
    engine = {"_target_": "wipx.sim.analytic.AnalyticSimulator", "step": 2e-4, "threads": 1}
    return replace(build({**node, "engine": engine}, "target"), rail=4.0, release_error=0.0)


def recorded(t: np.ndarray, x: np.ndarray, theta: np.ndarray) -> Recording:
    return Recording("r.csv", {"t": t, "x": x, "theta": theta, "u": np.zeros(len(t))})


# Scenarios


def test_the_papers_reference_is_a_velocity_that_begins_after_settling():
    scenario = SCENARIOS["tracking"]
    t = np.linspace(0.0, scenario.duration, 3001)
    asked = np.array([scenario.reference(time) for time in t])
    after = t >= scenario.begin
    np.testing.assert_array_equal(asked[~after], 0.0)
    np.testing.assert_allclose(
        asked[after, 2], 0.3 * np.sin(2.0 * np.pi * 0.4 * (t[after] - scenario.begin)), atol=1e-12
    )
    np.testing.assert_allclose(np.gradient(asked[:, 0], t)[after][1:-1], asked[after, 2][1:-1], atol=5e-3)
    np.testing.assert_array_equal(asked[:, [1, 3]], 0.0)


@pytest.mark.parametrize("name", sorted(SCENARIOS))
def test_every_scenario_is_a_trial_that_the_testbed_takes(name: str):
    scenario = SCENARIOS[name]
    trial = scenario.trial("r.csv", "b5")
    assert trial.duration == scenario.duration
    assert all(0.0 < event.t < trial.duration for event in trial.events)
    assert bool(trial.events) == scenario.has_events
    balance = scenario.balance(np.array([0.0, scenario.duration]), -0.16)
    assert (trial.load is None) == (balance[0] == 0.0)
    assert (balance[1] == 0.0) == (name == "load_goes")


# Judging


def test_errors_and_recovery_of_a_known_course():
    t = np.arange(6501) / 650.0
    x = np.where(t < 4.0, 1.0, 0.1)
    theta = -0.1 + np.where(t < 2.0, 0.3, 0.0)
    trial = TrialJudge(SCENARIOS["balancing"], 0.4, 0.06).judged(recorded(t, x, theta), "a1", 1, -0.1, -0.12)
    assert trial.failure is None
    assert trial.rmse_x == pytest.approx(np.sqrt(0.4 + 0.6 * 0.01), rel=2e-3)
    assert trial.rmse_pitch == pytest.approx(0.3 * np.sqrt(0.2), rel=2e-3)
    assert trial.rmse_target == pytest.approx(np.sqrt(0.2 * 0.32**2 + 0.8 * 0.02**2), rel=2e-3)
    assert trial.recovery == pytest.approx(4.0, abs=0.01)


def test_errors_count_from_where_tracking_begins_and_from_its_reference():
    scenario = SCENARIOS["tracking"]
    t = np.arange(0.0, scenario.duration + 1e-9, 2e-3)
    asked = np.array([scenario.reference(time)[0] for time in t])
    trial = TrialJudge(scenario, 0.4, 0.06).judged(
        recorded(t, asked + np.where(t < 4.9, 2.0, 0.05), np.zeros(len(t))), "a1", 1, 0.0, None
    )
    assert trial.rmse_x == pytest.approx(0.05, rel=1e-6)
    assert trial.recovery == 0.0


@pytest.mark.parametrize(("last", "why"), [((2.2, 0.3), RAIL_END), ((0.5, 0.99), FALL)])
def test_a_robot_that_was_stopped_counts_to_the_end_with_its_last_place(last: tuple[float, float], why: str):
    t = np.linspace(0.0, 1.0, 651)
    run = recorded(t, last[0] * t, last[1] * t)
    trial = TrialJudge(SCENARIOS["balancing"], 10.0, 10.0).judged(run, "a1", 1, 0.0, None)
    assert (trial.failure, trial.recovery) == (why, None)
    assert trial.stopped == pytest.approx(1.0)
    assert trial.rmse_x == pytest.approx(last[0] * np.sqrt((1.0 / 3.0 + 9.0) / 10.0), rel=2e-3)
    assert trial.course.x[-1] == last[0]


def test_a_robot_that_leaves_again_has_not_recovered():
    t = np.arange(5.0)
    assert settled(t, np.array([False, True, False, True, True])) == 3.0
    assert settled(t, np.array([True, True, True, True, False])) is None
    assert settled(t + 3.0, np.ones(5, dtype=bool)) == 0.0


# Events


@pytest.mark.parametrize("load", [None, Load(1.6, 0.45, -0.25)])
def test_a_push_gives_its_momentum_and_its_moment(bed: EmulatedTestbed, load: Load | None, fresh_seed: int):
    model = bed.nominal() if load is None else load.on(bed.nominal())
    p, rng = model.parameters, np.random.default_rng(fresh_seed)
    before = rng.uniform(-0.3, 0.3, 4)
    push = Push(0.0, 2.0, 0.5)
    gained = pushed(model, before, push) - before
    np.testing.assert_array_equal(gained[:2], 0.0)
    coupling = (
        p["body_mass"] * p["com_height"] * np.cos(before[1] - model.effects.get(BALANCE, {}).get("theta_eq", 0.0))
    )
    mass = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    inertia = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    assert mass * gained[2] - coupling * gained[3] == pytest.approx(2.0)
    assert inertia * gained[3] - coupling * gained[2] == pytest.approx(-2.0 * 0.5 * np.cos(before[1]))


def test_a_push_in_a_trial_moves_the_robot_at_its_time(bed: EmulatedTestbed):
    loop = Lqr().loop(bed.nominal())
    (run,) = bed.run([Trial("r", 2.0, events=(Push(1.0, 2.0, 0.5),))], loop, np.random.default_rng(0))
    rate = np.interp([0.99, 1.002], run.t, run["theta_dot"])
    expected = pushed(bed.nominal(), np.zeros(4), Push(1.0, 2.0, 0.5))[3]
    assert rate[1] - rate[0] == pytest.approx(expected, rel=0.15)
    assert np.max(np.abs(run["x"][run.t < 1.0])) < 0.01
    assert np.max(np.abs(run["x"][run.t > 1.0])) > 0.1


def test_a_load_that_comes_and_goes_changes_the_pitch_at_which_the_robot_stands(bed: EmulatedTestbed):
    loop = Lqr().loop(bed.nominal())
    events = (LoadChange(1.0, "a3"), LoadChange(7.0, None))
    (run,) = bed.run([Trial("r", 12.0, events=events)], loop, np.random.default_rng(0))
    assert run.duration > 11.9
    stands = [
        float(np.mean(run["theta"][(run.t > a) & (run.t < b)])) for a, b in ((0.5, 1.0), (5.0, 7.0), (10.5, 12.0))
    ]
    np.testing.assert_allclose(stands, [0.0, -0.09, 0.0], atol=0.04)
    assert np.min(run["x"]) < -1.0


def test_a_trial_without_events_is_what_it_was(bed: EmulatedTestbed):
    loop = Lqr().loop(bed.nominal())
    whole, cut = (
        next(bed.run([Trial("r", 1.0, "a3", events=events)], loop, np.random.default_rng(0)))
        for events in ((), (LoadChange(0.5, "a3"),))
    )
    # A load that replaces itself changes nothing but the bristles, which begin anew.
    np.testing.assert_allclose(cut["x"], whole["x"], atol=5e-3)
    np.testing.assert_array_equal(cut["x"][:300], whole["x"][:300])


@pytest.mark.parametrize("times", [(0.5, 0.5), (0.8, 0.2), (1.0,), (0.0,)])
def test_events_out_of_order_are_refused(bed: EmulatedTestbed, times: tuple[float, ...]):
    trial = Trial("r", 1.0, events=tuple(Push(t, 1.0, 0.5) for t in times))
    with pytest.raises(InputError, match="expected times in order and within 0 to 1 s"):
        next(bed.run([trial], Lqr().loop(bed.nominal()), np.random.default_rng(0)))


# Files and tables


def stored(folder: Path, *results) -> Path:
    for k, one in enumerate(results):
        job = folder / str(k)
        job.mkdir(parents=True)
        write_courses(one, job)
        write_json(job / "result.json", {"settings": {}, "result": plain_control(one)})
    return folder


def test_a_result_is_read_as_it_was_written(tmp_path: Path):
    before = result("lqr_equilibrium", heavy_stops=True, off=0.01)
    after = read_control(stored(tmp_path, before) / "0")
    assert plain_control(after) == plain_control(before)
    np.testing.assert_allclose(after.trials[-1].course.theta, before.trials[-1].course.theta)


def test_a_result_of_another_task_is_refused(tmp_path: Path):
    write_json(tmp_path / "result.json", {"settings": {}, "result": {"loss": 1.0}})
    with pytest.raises(InputError, match="not the result of task=control"):
        read_control(tmp_path)


def test_a_sweep_that_lacks_a_controller_or_mixes_experiments_is_refused():
    sweep = Path("runs/control")
    whole = [result(name, scenario=task) for task in ("balancing", "tracking") for name in ("lqr", "lqr_equilibrium")]
    found = by_scenario(whole, sweep, ("lqr", "lqr_equilibrium"))
    assert [[r.controller for r in results] for results in found.values()] == [["lqr", "lqr_equilibrium"]] * 2
    with pytest.raises(InputError, match="0 jobs of tracking with controller=lqr,"):
        by_scenario([*whole[:2], whole[3]], sweep, ("lqr", "lqr_equilibrium"))
    with pytest.raises(InputError, match="2 jobs of balancing with controller=lqr,"):
        by_scenario([*whole, whole[0]], sweep, ("lqr", "lqr_equilibrium"))
    with pytest.raises(InputError, match="balancing with different rails"):
        by_scenario([whole[0], replace(whole[1], rail=1.8)], sweep, ("lqr", "lqr_equilibrium"))


@pytest.mark.slow
def test_tables_pictures_and_film_come_from_a_finished_sweep(program: Program, tmp_path: Path):
    controllers = [result("lqr", heavy_stops=True), result("lqr_equilibrium", (0.2, 0.3), off=0.01)]
    methods = [result("lqr_equilibrium", method=m, off=o) for m, o in (("pure_sim", 0.04), ("ours", 0.01))]
    folder, studied = stored(tmp_path / "control", *controllers), stored(tmp_path / "methods", *methods)
    answer = program("task=table_control", f"task.folder={folder}", f"task.methods={studied}", "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"table.md", "table.tex", "balancing.png", "control.gif"} <= written
    assert "pure_sim" in (tmp_path / "out" / "table.md").read_text()
    (folder / "2").mkdir()
    again = program("task=table_control", f"task.folder={folder}", "hydra.run.dir=out2")
    assert again.status == 2
    assert "1 of 3 jobs have no result" in again.error


@pytest.mark.slow
def test_one_controller_runs_from_the_command_line_and_is_not_run_twice(program: Program, tmp_path: Path):
    arguments = (
        "task=control",
        "method=pure_sim",
        "objective=paper",
        "objective.at_rest=true",
        "sim@target.engine=analytic",
        "task.loads=[a1]",
        "task.per_load=1",
        "task.dataset.samples=30",
        "task.dataset.checked=1",
        "task.dataset.per_load=1",
        "hydra.run.dir=out",
    )
    answer = program(*arguments)
    assert answer.status == 0, answer.error
    assert "lqr: balancing, 1 trials, 0 stopped" in answer.out
    assert read_control(tmp_path / "out").trials[0].rmse_x > 0.2
    assert "finished before" in program(*arguments).out
    assert program(*arguments, "task.loads=[c1]", "hydra.run.dir=out2").status == 2
    refused = program(*arguments, "task.scenario=push", "target=recordings", "target.path=.")
    assert refused.status == 2
