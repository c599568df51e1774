"""`make hardware-demo`: from an emulated robot on a CAN bus to what it conceals, and a payload."""

import json
from pathlib import Path

import pytest


@pytest.mark.slow
@pytest.mark.flaky(reruns=2)  # in real time: a machine that stalls for half a second lets the robot fall
def test_the_demo_finds_what_the_emulator_conceals_and_balances_a_payload(program, tmp_path: Path):
    answer = program("+experiment=hardware_demo", "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    out = tmp_path / "out"
    found = json.loads((out / "diagnosis" / "diagnosis.json").read_text())["effects"]
    friction = [effect for effect in found if effect["name"].startswith("translation/")]
    assert friction
    assert "translation/coulomb.F_c = 1 N" in answer.out
    assert "lqi, completed model: stays up" in answer.out
    assert "of an emulated robot, not of a real one" in answer.out
    assert (out / "payload.png").is_file()
    assert len(list(out.glob("*/*_loop.png"))) == len(list(out.glob("*/*.asc"))) == 6
    again = program("+experiment=hardware_demo", "hydra.run.dir=out")
    assert (again.status, again.out) == (0, answer.out)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("target=emulated",), "it needs target=emulated_hardware"),
        (("task.load=b9",), "unknown load 'b9'"),
        (("controller=lqr_equilibrium",), "trains no estimator"),
        (("target.concealed.frictoin=1",), "frictoin"),
        (("target.lines=usb",), "target.lines: unknown value 'usb'"),
    ],
)
def test_what_the_demo_cannot_do_is_refused_in_one_line(
    program, tmp_path: Path, arguments: tuple[str, ...], expected: str
):
    answer = program("+experiment=hardware_demo", *arguments, "hydra.run.dir=out")
    assert answer.status == 2
    assert answer.error.count("\n") == 1, answer.error
    assert expected in answer.error
    assert not (tmp_path / "out").exists()
