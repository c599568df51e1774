"""`task=hardware_demo`: the emulator as a robot on a CAN bus: recorded, diagnosed, balanced with a payload.

Recording and diagnosis are stages: commands of this program, which stand in their folders. What the emulator conceals
is looked at last.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.control.controller import Controller
from wipx.control.lqr import Lqr
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.loop_quality import quality_words
from wipx.core.recording import Recording
from wipx.hardware.emulated_hardware import EmulatedHardware
from wipx.hardware.excitations import EXCITATIONS, ExcitationName
from wipx.hardware.target import Trial
from wipx.recordings.model_file import read_model
from wipx.tasks.files.results import written_together
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.loops import missed, worst
from wipx.tasks.shared.progress import StageProgress
from wipx.tasks.shared.stages import Chain, Stage, claim
from wipx.tasks.shared.trials import write_recording

FORWARDED = ("target", "seed", "tracking")  # what the stages may be told
NAMES = ("lqr", "completed")  # of the two trials with the payload


@dataclass(frozen=True)
class HardwareDemo:
    """Go the way of a robot on a CAN bus, from its first recording to a payload.

    Attributes:
        excitations: That the diagnosis learns from.
        duration: Of each [s].
        load: Name of the target's load that is balanced, once by the LQR of the nominal model, once by the chosen
            controller on the completed one; neither knows the load.
        balance: Of each of these trials [s].
    """

    excitations: tuple[ExcitationName, ...] = EXCITATIONS
    duration: float = 6.0
    load: str = "a2"
    balance: float = 6.0

    def __post_init__(self) -> None:
        check_positive(duration=self.duration, balance=self.balance)

    def run(self, job: Job) -> None:
        """Record, diagnose, balance, compare."""
        target = job.part("target")
        if not isinstance(target, EmulatedHardware):
            raise InputError(
                "task=hardware_demo shows what an emulator conceals, so it needs target=emulated_hardware; for a robot "
                "of your own use task=record and task=diagnose"
            )
        if self.load not in target.loads:
            raise unknown_name("load", self.load, target.loads, "task.load")
        controller: Controller = job.part("controller")
        if controller.asks_estimator:
            raise InputError("task=hardware_demo trains no estimator; use controller=lqi, pid, mpc_offset_free or lqr")
        claim(job.out, job.overrides)
        with StageProgress("hardware_demo") as progress:
            chain = Chain(job.out, progress)
            chain.run(*self._stages(job)[:1])
            chain.run(*self._stages(job)[1:])
            progress("payload", chain.done)
            self._balance(job.out, target, controller)
        print(self._story(job.out, target, str(job.chosen.get("controller", ""))))

    def _stages(self, job: Job) -> tuple[Stage, Stage]:
        told = [one for one in job.overrides if _group(one) in FORWARDED and not one.startswith("target=")]
        sets = f"task.excitations=[{','.join(self.excitations)}]", f"task.duration={self.duration}"
        record = ("task=record", "target=emulated_hardware", *sets, *told)
        diagnose = ("task=diagnose", f"recordings.path='{job.out}/recordings'")
        general = [one for one in told if _group(one) != "target"]
        return Stage("recordings", record, 0.4), Stage("diagnosis", (*diagnose, *general), 0.4)

    def _balance(self, out: Path, target: EmulatedHardware, controller: Controller) -> None:
        """Both trials with the payload, where they are not done yet."""
        completed = read_model(out / "diagnosis" / "model.yaml")
        folder = out / "payload"
        folder.mkdir(exist_ok=True)
        listed = zip(NAMES, ((Lqr(), target.nominal()), (controller, completed)), strict=True)
        for name, (law, model) in listed:
            if not (folder / f"{name}.csv").is_file():
                trial = Trial(f"{name}.csv", self.balance, self.load)
                placed = replace(target, logs=str(folder))
                for recording in placed.run([trial], law.loop(model), np.random.default_rng(0)):
                    write_recording(folder / recording.name, recording)

    def _story(self, out: Path, target: EmulatedHardware, controller: str) -> str:
        """What was found and what is true, the payload, and the loop; leaves the picture of the payload."""
        from wipx.report.payload_figure import draw_payload

        runs = {name: _read(out / "payload" / f"{name}.csv") for name in NAMES}
        load = target.loads[self.load]
        balance = load.equilibrium(target.nominal())
        titles = {"lqr": "LQR, nominal model", "completed": f"{controller}, completed model"}
        said = f"{load.mass:g} kg, {load.side:+.2f} m beside the axis: balance at {balance:+.3f} rad"
        with written_together(out) as folder:
            named = {titles[name]: run for name, run in runs.items()}
            draw_payload(named, balance, f"Emulated hardware, {said}; unknown to both", folder / "payload.png")
        answer = json.loads((out / "diagnosis" / "diagnosis.json").read_text(encoding="utf-8"))
        lines = ["What the emulator conceals, and what the diagnosis of its recordings found:"]
        lines += _compared(target.hidden(), answer["effects"])
        lines.append(f"Payload of {said}, unknown to both controllers:")
        lines += [f"  {titles[name]}: {self._outcome(run)}" for name, run in runs.items()]
        loops = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(out.glob("*/*_loop.json"))]
        skipped, lost = missed(loops)
        lines.append(f"Loop, worst of {len(loops)} trials: {quality_words(worst(loops))}")
        lines.append(
            f"  {skipped} of {sum(loop['steps'] for loop in loops) + skipped} steps skipped, {lost} replies lost"
        )
        lines += ["All recordings are of an emulated robot, not of a real one.", ""]
        lines += [f"page: {out / 'diagnosis' / 'report.html'}", f"pictures: {out / 'payload.png'}, {out}/*/*_loop.png"]
        return "\n".join(lines)

    def _outcome(self, run: Recording) -> str:
        if run.duration < 0.95 * self.balance:
            return f"stopped after {run.duration:.1f} s at x = {run['x'][-1]:+.2f} m"
        late = run.between(float(run.t[-1]) - 1.0, float("inf"))
        return f"stays up; in the last second within {np.abs(late['x']).max():.2f} m of where it should be"


def _compared(hidden: Mapping[str, tuple[float, str]], found: list[dict[str, Any]]) -> list[str]:
    """A line for everything that is concealed, and for every effect beside it."""
    numbers = {
        f"{effect['name']}.{symbol}": (number, effect["equivalent"])
        for effect in found
        for symbol, number in effect["parameters"].items()
    }
    lines = []
    for name, (value, unit) in hidden.items():
        line = f"  {name} = {value:g} {unit}: "
        effect = name.partition(".")[0]
        if name in numbers:
            number, ties = numbers[name]
            low, high = number["ci95"]
            tied = f"; these recordings cannot tell it from {', '.join(ties)}" if ties else ""
            lines.append(f"{line}found {number['value']:.3g} [{low:.3g}, {high:.3g}]{tied}")
        else:
            stands = [one["name"] for one in found if effect in one["equivalent"]]
            lines.append(line + (f"{stands[0]} in its place, which cannot be told from it" if stands else "not found"))
    concealed = {name.partition(".")[0] for name in hidden}
    others = [effect["name"] for effect in found if effect["name"] not in concealed]
    return [*lines, *(f"  {name}: found beside it" for name in others)]


def _read(path: Path) -> Recording:
    table = np.genfromtxt(path, delimiter=",", names=True)
    return Recording(path.name, {name: table[name] for name in table.dtype.names or ()})


def _group(override: str) -> str:
    return override.lstrip("+~").partition("=")[0].partition(".")[0]
