"""What is compiled ahead is what a diagnosis uses."""

import subprocess

import pytest
from diagnosis.recorded import Bench, nominal_model, recorded

import wipx.compilation
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.cache import AHEAD
from wipx.sim.mujoco import MujocoSimulator
from wipx.sim.simulator import Simulator


def test_filters_are_compiled_ahead_for_the_arrays_of_a_diagnosis(fresh_seed: int):
    before = {kernel: set(kernel.signatures) for kernel, _ in AHEAD}
    recordings = recorded("double_pendulum", {"joint1/coulomb": {"F_c": 0.2}}, seed=fresh_seed)
    Bench(nominal_model("double_pendulum"), recordings, {}).diagnosed()
    for kernel, types in AHEAD:
        assert types in kernel.signatures, kernel
        assert set(kernel.signatures) - before[kernel] <= {types}, kernel


def test_nothing_is_said_where_all_is_compiled(capfd: pytest.CaptureFixture[str]):
    wipx.compilation.compile_simulator()
    wipx.compilation.compile_filters_meanwhile(AnalyticSimulator())
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("simulator", "begun"), [(AnalyticSimulator(), 1), (MujocoSimulator(), 0)], ids=["own", "other"]
)
def test_a_task_that_finds_nothing_compiled_says_so(
    simulator: Simulator, begun: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    calls: list[list[str]] = []
    monkeypatch.setattr(wipx.compilation, "is_kept", lambda kernel: False)
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: calls.append(command))
    wipx.compilation.compile_filters_meanwhile(simulator)
    assert len(calls) == begun
    assert ("compiling the simulator" in capfd.readouterr().err) == bool(begun)
