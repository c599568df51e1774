"""What is compiled ahead is what a diagnosis uses."""

import subprocess

import pytest
from diagnosis.recorded import Bench, nominal_model, recorded

import wipx.compilation
from wipx.sim import first_use
from wipx.sim.cache import AHEAD


@pytest.mark.slow
def test_filters_are_compiled_ahead_for_the_arrays_of_a_diagnosis(fresh_seed: int):
    before = {kernel: set(kernel.signatures) for kernel, _ in AHEAD}
    recordings = recorded("double_pendulum", {"joint1/coulomb": {"F_c": 0.2}}, seed=fresh_seed)
    Bench(nominal_model("double_pendulum"), recordings, {}).diagnosed()
    for kernel, types in AHEAD:
        assert set(kernel.signatures) - before[kernel] <= {types}, kernel
    # Not every robot needs all: some are for recorded forces, noise that lasts, or controllers.
    assert sum(types in kernel.signatures for kernel, types in AHEAD) > len(AHEAD) // 2


def test_nothing_is_said_where_all_is_compiled(capfd: pytest.CaptureFixture[str]):
    wipx.compilation.compile_simulator()
    capfd.readouterr()
    first_use.compile_filters_meanwhile.cache_clear()
    wipx.compilation.compile_simulator()
    assert capfd.readouterr().err == ""


def test_a_program_that_finds_nothing_compiled_says_so_once(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    calls: list[tuple[str, ...]] = []
    monkeypatch.setattr(first_use, "is_kept", lambda kernel: False)
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: calls.append(command))
    first_use.compile_filters_meanwhile.cache_clear()
    for _ in range(2):
        wipx.compilation.compile_simulator()
    assert calls == [first_use.FILTERS]
    assert capfd.readouterr().err.count("compiling the simulator") == 1


def test_a_program_that_may_start_no_other_one_compiles_by_itself(monkeypatch: pytest.MonkeyPatch):
    def refused(command: tuple[str, ...], **_: object) -> None:
        raise PermissionError(command)

    monkeypatch.setattr(first_use, "is_kept", lambda kernel: False)
    monkeypatch.setattr(subprocess, "Popen", refused)
    first_use.compile_filters_meanwhile.cache_clear()
    wipx.compilation.compile_simulator()
