"""Diagnoses as they would be left, made up from the laws themselves and noise."""

from dataclasses import replace

import numpy as np
from report import synthetic

from wipx.core.curve import Curve
from wipx.core.diagnosis import Alternative, Bound, ConsideredEffect, Diagnosis, FoundEffect
from wipx.core.location import ErrorMap, Location, Period, Region
from wipx.core.model import Model
from wipx.core.next_experiment import Experiment, NextExperiment
from wipx.core.plant import plant_of
from wipx.core.remainder import Unexplained
from wipx.core.results import Estimate, FitErrors
from wipx.core.suspect import Suspect, SuspectedSize

UNITS = {**synthetic.UNITS, "x_dot": "m/s", "theta_dot": "rad/s"}
BODY = {
    "body_mass": 2.6,
    "wheel_mass": 1.2,
    "com_height": 0.35,
    "body_inertia": 0.11,
    "wheel_inertia": 0.0023,
    "wheel_radius": 0.0625,
}
NOTHING_LEFT = Unexplained(False, 0.31, None, "", (), None)
RUNS = ("r3.csv", "r1.csv", "r2.csv", "r4.csv")


def law_curve() -> Curve:
    """Coulomb friction over the wheel's speed, as noisy bins see it."""
    rng = np.random.default_rng(1)
    at, bins = np.linspace(-0.8, 0.8, 161), np.linspace(-0.76, 0.76, 20)
    spread = 0.08 + 0.35 * np.abs(bins) ** 3
    force = -3.1 * np.sign(bins) + rng.normal(0.0, spread)
    return Curve("force", "x_dot", "m/s", "N", at, -3.1 * np.sign(at), bins, force, spread)


def error_map() -> ErrorMap:
    """Excess concentrated at low speed, with a corner where the robot never was."""
    x, v = np.linspace(-0.5, 0.5, 25), np.linspace(-0.8, 0.8, 21)
    xm, vm = np.meshgrid(0.5 * (x[1:] + x[:-1]), 0.5 * (v[1:] + v[:-1]), indexing="ij")
    excess = 4.0 * np.exp(-((vm / 0.15) ** 2) - ((xm - 0.1) / 0.4) ** 2) + 0.2
    excess[(xm / 0.5) ** 2 + (vm / 0.8) ** 2 > 1.0] = np.nan
    times = tuple(np.arange(0.25, 10.0 - 2.0 * run, 0.5) for run in range(len(RUNS)))
    along = tuple(np.abs(np.sin(0.7 * t + i)) * 3.0 - 0.1 for i, t in enumerate(times))
    return ErrorMap(("x", "x_dot"), ("m", "m/s"), (x, v), excess, RUNS, times, along)


def found_effects() -> tuple[FoundEffect, ...]:
    """Coulomb friction with a curve, and a delay that cannot be told from a lag."""
    coulomb = FoundEffect(
        name="translation/coulomb",
        law="-F_c s(v), any force in [-F_c, F_c] at v = 0",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
        outside_vocabulary=False,
        parameters=(Estimate("translation/coulomb.F_c", "N", 0.0, 3.1042, 2.93, 3.29, False, "Coulomb level"),),
        equivalent=(),
        rivals=(
            Alternative("translation/stribeck", 8.2, {"F_c": 3.02, "F_s": 3.4, "v_s": 0.05}),
            Alternative("translation/viscous", 27.5, {"sigma": 9.13}),
        ),
        log_evidence_gain=412.3,
        heldout_gain=0.812,
        present_probability=0.9996,
        share=0.93,
        curve=law_curve(),
    )
    delay = FoundEffect(
        name="actuator/delay",
        law="F(t) = u(t - tau)",
        source="contract, section 3",
        outside_vocabulary=False,
        parameters=(Estimate("actuator/delay.tau", "s", 0.0, 0.00412, 0.00395, 0.0043, False, "delay"),),
        equivalent=("actuator/lag",),
        rivals=(Alternative("actuator/lag", 0.7, {"tau": 0.0041}),),
        log_evidence_gain=38.0,
        heldout_gain=0.061,
        present_probability=0.62,
        share=0.07,
        curve=None,
    )
    return coulomb, delay


def suspects() -> tuple[Suspect, ...]:
    """The named friction at a size that agrees, and one that is neither shown nor excluded."""
    level = Estimate("translation/coulomb.F_c", "N", 0.0, 3.1042, 2.93, 3.29, False, "Coulomb level")
    held = SuspectedSize({"F_c": 3.2}, 0.8, 0.8, True, 2.4, False, 1.02)
    named = Suspect("translation/coulomb", True, (), (level,), 412.3, 14.2, 0.812, True, 0.0, held, "It agrees.")
    drag = Estimate("pitch/viscous.sigma", "N m s/rad", 0.0, 0.002, 0.0, 0.011, False, "viscous friction")
    held = SuspectedSize({"sigma": 0.05}, 230.0, 231.0, False, 2.1, True, 3.1)
    absent = Suspect("pitch/viscous", False, (), (drag,), 0.6, 12.9, -0.01, False, -0.6, held, "It is excluded.")
    return named, absent


def asked() -> Diagnosis:
    """The same answer, asked about suspects."""
    return replace(mismatch(), suspects=suspects())


def mismatch() -> Diagnosis:
    """Two effects, one corrected number, one open question."""
    plant = plant_of("wip")
    nominal = Model(plant, plant.complete(BODY, "synthetic"), {"pitch/viscous": {"sigma": 0.02}})
    found = {"translation/coulomb": {"F_c": 3.1042}, "actuator/delay": {"tau": 0.00412}}
    errors = synthetic.result()
    assert errors.held_out is not None
    t = np.arange(0.0, 12.0, 0.02)
    multisine = Experiment("multisine", "Let the robot follow a multisine of 0.5 to 6 Hz in x for 12 s.", 9.4)
    return Diagnosis(
        title="Balancing robot, gravel floor",
        source="recordings/balance",
        units=UNITS,
        verdict="mismatch",
        sentence="Coulomb friction of 3.10 N on the rail joint and a delay of 4.1 ms of the actuator are missing.",
        nominal=nominal,
        model=nominal.with_effects(found).with_values({"body_inertia": 0.118}),
        effects=found_effects(),
        corrected=(Estimate("body_inertia", "kg m^2", 0.11, 0.118, 0.114, 0.122, False, "of the body about its CoM"),),
        location=Location(
            sites={"translation": 0.91, "actuator": 0.07, "pitch": 0.02},
            regions=(Region("x_dot", -0.1, 0.1, 0.71),),
            times=(Period("r3.csv", 4.9, 10.0, 0.98),),
            map=error_map(),
        ),
        fit=errors.fit,
        held_out=errors.held_out,
        unexplained=NOTHING_LEFT,
        candidates=(
            ConsideredEffect(
                "translation/viscous", 210.0, False, "Coulomb friction explains more with as many numbers"
            ),
            ConsideredEffect("translation/coulomb", 412.3, True, "explains the most"),
            ConsideredEffect("translation/stribeck", 413.0, False, "adds 0.7 nats for two more numbers"),
            ConsideredEffect("actuator/delay", 38.0, True, "explains the most beside Coulomb friction"),
            ConsideredEffect("actuator/lag", 37.6, False, "cannot be told from the delay"),
            ConsideredEffect("pitch/coulomb + actuator/gain", 6.1, False, "not significant"),
            ConsideredEffect("environment/spring", -0.3, False, "adds nothing"),
            *(
                ConsideredEffect(f"actuator/{kind}", 0.5, False, "adds nothing")
                for kind in ("backlash", "ripple", "gain")
            ),
            *(
                ConsideredEffect(f"pitch/{kind}", 0.2, False, "adds nothing")
                for kind in ("stribeck", "lugre", "coulomb")
            ),
            ConsideredEffect("sensor_theta/bias", float("nan"), False, "could not be fitted"),
        ),
        bounds=(
            Bound("environment/rail_tilt.angle", -0.0011, 0.0009, "rad"),
            Bound("actuator/gain.k", 0.985, 1.012, "1"),
            Bound("pitch/coulomb.F_c", 0.0, 0.013, "N m"),
        ),
        weak=("The recordings hold no motion faster than 0.8 m/s, so a torque-speed limit above it would not show.",),
        next_experiment=NextExperiment(
            question="Is it a delay or a lag of the actuator?",
            best=multisine,
            menu=(
                multisine,
                Experiment("steps", "Let the robot step between two places every 2 s.", 3.1),
                Experiment("rest", "Let the robot stand still for 20 s.", 0.2),
            ),
            reference={"t": t, "x_ref": 0.1 * np.sin(5.0 * t) + 0.05 * np.sin(13.0 * t)},
        ),
        traces=(
            synthetic.trace("r3.csv", held_out=True),
            synthetic.trace("r1.csv", held_out=False),
            synthetic.trace("r2.csv", held_out=False),
        ),
        notes=("Time steps of r2.csv jitter by 12 %.",),
        seconds=41.7,
    )


def consistent() -> Diagnosis:
    """Nothing is missing, nothing is open."""
    whole = mismatch()
    floor = {"x": 0.0008, "theta": 0.00128}
    good = FitErrors(0.5, 40, nominal=floor, completed=floor, noise_floor=floor)
    return replace(
        whole,
        verdict="consistent",
        sentence="The nominal model explains the recordings up to noise.",
        model=whole.nominal,
        effects=(),
        corrected=(),
        location=Location({}, (), (), None),
        fit=good,
        held_out=good,
        candidates=whole.candidates[-4:],
        weak=(),
        next_experiment=None,
        notes=(),
    )


def unexplained() -> Diagnosis:
    """A force over the position that no effect explains, next to one that was found."""
    whole = mismatch()
    x = np.linspace(-0.5, 0.5, 41)
    shape = 0.8 * np.sin(9.0 * x) * np.exp(-((x / 0.3) ** 2))
    bins = x[::3]
    curve = Curve("force", "x", "m", "N", x, shape, bins, shape[::3] + 0.03, np.full(len(bins), 0.06))
    return replace(
        whole,
        verdict="unexplained",
        sentence="Coulomb friction on the rail joint is missing, and a force over x that no known effect explains.",
        effects=whole.effects[:1],
        unexplained=Unexplained(True, 3e-7, "translation", "a force over x", ("translation/load_friction",), curve),
    )
