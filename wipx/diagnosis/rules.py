"""The rules of a diagnosis: every number that decides an answer, with its unit, its meaning and where it comes from.

`conf/diagnosis/default.yaml` holds the same values, so that a sweep over a rule is an ordinary experiment, and
`docs/rules.md` is the table of them. Numerics (steps, grids, how many starts are tried) stay where they are used, and
the sizes at which a law amounts to a simpler one stand with the law (`wipx.effects`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any

from wipx.core.errors import InputError

BIC = "derived: odds of 3000 to 1 cover a search over some thirty effects and their grids"
DEVELOPING = "chosen on generated robots while developing"
REAL = "chosen on public recordings of real machines"
UNLIMITED = 1e9  # finite: results are written as JSON
JUDGEMENT = "judgement: what is small enough not to matter"


@dataclass(frozen=True)
class Note:
    """What is known of a rule.

    Attributes:
        unit: Of its value; empty for a pure number.
        meaning: What it decides.
        origin: Derived, from the literature, or chosen on which data.
        neutral: The value with which the rule decides nothing; None where it has none.
    """

    unit: str
    meaning: str
    origin: str
    neutral: float | None


def rule(value: float, unit: str, meaning: str, origin: str, neutral: float | None = None) -> Any:
    """A field that is a rule."""
    return field(default=value, metadata={"note": Note(unit, meaning, origin, neutral)})


class EvidenceRules:
    """What both kinds of evidence are asked; the values here decide nothing.

    Attributes:
        promising: Share of the best expected gain below which an effect is not fitted.
        worthless: Expected gain below which an effect is not fitted [nats].
        unproven: Effects that need not transfer to held-out recordings, at most.
        unsteady: Usual standard deviation from run to run, as a share of a size.
    """

    promising = 0.0
    worthless = -UNLIMITED
    unproven = 0
    unsteady = 0.0


@dataclass(frozen=True)
class InnovationRules(EvidenceRules):
    """Which effects innovations let in."""

    promising: float = rule(
        0.05, "", "share of the best expected gain below which an effect is not fitted", DEVELOPING, 0.0
    )
    worthless: float = rule(
        3.0,
        "nats",
        "expected gain below which an effect is not fitted",
        "derived: less than the penalty of one number",
        0.0,
    )
    unproven: int = rule(
        4,
        "effects",
        "effects that need not transfer to held-out recordings, at most",
        f"{REAL}: small effects fill up what stays unexplained",
        99,
    )


@dataclass(frozen=True)
class ForecastRules(EvidenceRules):
    """Which effects forecasts let in: each is fitted, and none is taken on trust."""

    unsteady: float = rule(
        0.1,
        "of the size",
        "usual standard deviation of a size from run to run; widens intervals",
        "from the literature: load and temperature change friction by tens of per cent (Bittencourt, Gunnarsson 2012)",
        0.0,
    )
    level: float = rule(
        0.1,
        "probability",
        "chance that any effect is named without cause, by Vuong's test on stretches of time",
        "judgement: one false law in ten robots is what a user can live with; test: Vuong 1989, Econometrica 57(2)",
        UNLIMITED,
    )
    least_removed: float = rule(
        0.5,
        "of the squared scale of the errors that stay",
        "what an effect removes at some joint from predictions over 0.5 s, below which it is not named",
        "judgement: what is smaller may be a part of what no law describes",
        0.0,
    )
    undeclared: float = rule(
        0.015,
        "relative standard deviation",
        "doubt of a rigid body's numbers that are given as exact",
        "derived: data sheets, scales and rulers err by 1 to 2 %",
        0.0,
    )


@dataclass(frozen=True)
class SelectionRules:
    """What an effect must gain, and by how much one answer must lead another."""

    least_gain: float = rule(8.0, "nats", "gain of an effect beyond the penalty of BIC (Schwarz 1978)", BIC, 0.0)
    least_share: float = rule(
        0.01,
        "",
        "the same, as a share of what is explained already; and what a simple law may lack",
        f"{DEVELOPING}: what a law misses (how a joint comes to rest) is not worth another effect",
        0.0,
    )
    most_asked: float = rule(80.0, "nats", "what that share asks for, at most", DEVELOPING, UNLIMITED)
    nonsmooth_share: float = rule(
        0.05,
        "",
        "the same share beside backlash, for effects of the actuator and for residuals",
        f"{DEVELOPING}: a drive crosses its gap differently from every law, which looks like a lag or a gain",
        0.01,
    )
    sticking_share: float = rule(
        0.05,
        "",
        "share of what is explained that bristles may gain over Coulomb friction where their bending is invisible",
        DEVELOPING,
        0.01,
    )
    least_lead: float = rule(
        4.0, "nats", "lead of a replacement over what it replaces, and what a simple law may lack", DEVELOPING, 0.0
    )
    most_effects: int = rule(
        8,
        "effects",
        "effects of an answer, at most",
        "chosen on the emulated testbed, which has eight: with four, predictions err three times as much",
        99,
    )
    expected_share: float = rule(
        0.5,
        "of what an effect must gain",
        "expected gain from which an effect of one of many joints is fitted, and gain, not enough alone, from which a "
        "second effect is sought",
        "derived: of two effects that share what they must gain, one gains half of it",
        0.0,
    )


@dataclass(frozen=True)
class ConfirmationRules:
    """Which chosen effects are kept."""

    irrelevant: float = rule(
        0.1, "noise floors", "change of predictions below which an effect is dropped", JUDGEMENT, 0.0
    )
    certain: float = rule(
        3.0,
        "standard deviations",
        "distance from zero that some size of an effect must have",
        "chosen on 600 opened robots: of 436 names four are less certain, and all four are wrong",
        0.0,
    )
    doubtful: float = rule(
        50.0, "nats", "gain below which an effect must transfer to held-out recordings", DEVELOPING, 0.0
    )
    certain_beside_backlash: float = rule(
        150.0, "nats", "gain beside a backlash from which an effect is certain whatever its interval", DEVELOPING, 0.0
    )
    tolerated: float = rule(
        0.05,
        "of the squared error",
        "by how much one effect more may worsen held-out predictions",
        REAL,
        UNLIMITED,
    )


@dataclass(frozen=True)
class ResidualRules:
    """When something is left over."""

    level: float = rule(1e-3, "p value, corrected", "chance of a residual that is none", "usual level", 1.0)
    least_gain: float = rule(20.0, "nats", "gain of a curve", DEVELOPING, 0.0)
    least_swing: float = rule(
        15.0, "nats", "gain of a resonance", "derived from that of a curve: three numbers instead of nine", 0.0
    )
    least_share: float = rule(
        0.02, "", "gain of both, as a share of what is explained", f"{DEVELOPING}: less changes no prediction", 0.0
    )
    beside_means: float = rule(
        1.5,
        "times",
        "what both must gain in a log of mean commands",
        f"{DEVELOPING}: means answer to noise within a row",
        1.0,
    )
    promising: float = rule(
        0.3, "", "share of the best expected gain, and of the required one, for a law from beyond", DEVELOPING, 0.0
    )
    telling: float = rule(
        0.3, "of the variance", "share that a family must explain for a left force to go with it", JUDGEMENT, 0.0
    )


@dataclass(frozen=True)
class TrustRules:
    """Whether laws hold, or only nearly."""

    far_off: float = rule(
        5.0, "times what noise makes them", "errors of predictions that are far off", DEVELOPING, UNLIMITED
    )
    near_floor: float = rule(
        2.5, "noise floors", "errors of a right model's predictions, at most", DEVELOPING, UNLIMITED
    )
    quiet: float = rule(
        5e-4,
        "usual forces s^0.5",
        "noise of a joint's force that innovations may ask for where laws hold",
        "chosen on 61 generated robots: 3.7e-4 at most in 37 exact ones, more than 5e-4 in 17 of 24 dirty ones",
        UNLIMITED,
    )
    distrusted: float = rule(
        1.5,
        "times",
        "ratio of errors to the nominal model's, to those from the best states, or to errors that are far off, beyond "
        "which a model is wrong",
        "chosen on 24 exact generated robots: one at 1.51, the others below 1.4; 34 err at most 1.2 times far off",
        UNLIMITED,
    )
    foretold: float = rule(
        0.5,
        "of the variance of innovations",
        "share that earlier ones foretell, beyond which a joint's large errors are no noise",
        "derived: most of it; at most 0.8 with a sensor's lasting noise, at least 0.8 on real machines",
        UNLIMITED,
    )
    noise_lasts: float = rule(
        0.11,
        "s",
        "correlation time of a sensor's noise, at most; what lasts longer is a force",
        "judgement: after half a second a hundredth of it is left",
        UNLIMITED,
    )
    smoothed: float = rule(
        1e-3,
        "of the power of second differences",
        "share at high frequencies below which the signals of an arm were low-passed, so that single rows tell nothing",
        "derived: white noise of a thirtieth of the smallest accelerations shows; nine tenths of its power lie there",
        0.0,
    )


@dataclass(frozen=True)
class AnswerRules:
    """What is said of numbers, rivals and places."""

    told_apart: float = rule(
        3.0, "standard deviations", "distance from which recordings tell two explanations apart", "0.3 % level", 0.0
    )
    confidence: float = rule(
        0.95, "probability", "with which a suspected size is excluded (ratio of likelihoods, Wilks 1938)", "usual level"
    )
    as_good: float = rule(
        1.92,
        "nats",
        "loss of a position that is as good as a fit, at least",
        "derived: half the 95 % quantile of chi squared",
    )
    law_misfit: float = rule(
        5e-4,
        "of the evidence",
        "what a right law may miss; widens intervals",
        f"{DEVELOPING}: laws are approximations",
        0.0,
    )
    moves: float = rule(
        1e-3, "p value", "chance below which a number differs from run to run (DerSimonian, Laird 1986)", JUDGEMENT, 0.0
    )
    unfelt: float = rule(
        1e-3,
        "standard deviations",
        "change of innovations below which a number may be anything",
        JUDGEMENT,
        0.0,
    )
    wide: float = rule(0.3, "relative half width", "interval of a weak number, at least", JUDGEMENT, UNLIMITED)
    implausible: float = rule(
        2.0, "times", "factor by which an owner's number is wrong, beyond which the answer warns", JUDGEMENT, UNLIMITED
    )
    concentrated: float = rule(0.6, "of the mismatch", "share of an interval that is told", JUDGEMENT, 0.0)
    few_rows: float = rule(0.3, "of the rows", "rows of that interval, at most", JUDGEMENT, 1.0)
    uneven: float = rule(
        0.05, "of the usual time step", "variation of time steps from which the answer says so", JUDGEMENT, UNLIMITED
    )


@dataclass(frozen=True)
class ExperimentRules:
    """Which next experiment is worth proposing."""

    useless: float = rule(
        1.0, "standard deviations", "separation below which an experiment settles nothing", JUDGEMENT, 0.0
    )
    most_repeats: int = rule(20, "runs", "repeats of an experiment that are proposed, at most", JUDGEMENT, 1000)


@dataclass(frozen=True)
class PlausibilityRules:
    """When robot.yaml, or the reading of the log, is refused as grossly wrong."""

    overwhelming: float = rule(
        0.05,
        "nats per recorded value",
        "gain of a mistake that is undone, beyond the best effect's",
        "derived: errors from row to row 5 % smaller throughout",
        UNLIMITED,
    )
    run_away: float = rule(
        0.01, "of the rows", "rows far from the recording from which a model has run away", DEVELOPING, 1.0
    )
    least_motion: float = rule(
        0.005, "m or rad", "travel of a recorded robot, at least; a unit that leaves less is no mistake", JUDGEMENT, 0.0
    )
    least_gyration: float = rule(
        0.01, "", "inertia of a body over m_b L^2, at least", "derived: bodies that people build", 0.0
    )
    most_gyration: float = rule(
        4.0, "", "inertia of a body over m_b L^2, at most", "derived: bodies that people build", UNLIMITED
    )


@dataclass(frozen=True)
class Rules:
    """All rules of a diagnosis, zero or more.

    Attributes:
        selection: What an effect must gain.
        innovations: Which effects innovations let in.
        forecasts: Which effects forecasts let in.
        confirmation: Which chosen effects are kept.
        residuals: When something is left over.
        trust: Whether laws hold, or only nearly.
        answer: What is said of numbers, rivals and places.
        experiment: Which next experiment is worth proposing.
        plausibility: When a description of a robot is refused.

    Raises:
        InputError: a rule is negative or no number.
    """

    selection: SelectionRules = SelectionRules()
    innovations: InnovationRules = InnovationRules()
    forecasts: ForecastRules = ForecastRules()
    confirmation: ConfirmationRules = ConfirmationRules()
    residuals: ResidualRules = ResidualRules()
    trust: TrustRules = TrustRules()
    answer: AnswerRules = AnswerRules()
    experiment: ExperimentRules = ExperimentRules()
    plausibility: PlausibilityRules = PlausibilityRules()

    def __post_init__(self) -> None:
        for name, value, note in self.each():
            if not value >= 0.0:
                raise InputError(f"diagnosis.{name} is {value:g}; expected zero or more [{note.unit or '-'}]")

    def each(self) -> Iterator[tuple[str, float, Note]]:
        """Name "part.rule", value and note of every rule."""
        for part in fields(self):
            values = getattr(self, part.name)
            for one in fields(values):
                yield f"{part.name}.{one.name}", getattr(values, one.name), one.metadata["note"]

    def without(self, name: str) -> "Rules":
        """The same with one rule "part.rule" at its neutral value.

        Raises:
            KeyError: there is no such rule, or it has no neutral value.
        """
        neutral = {key: note.neutral for key, _, note in self.each()}[name]
        if neutral is None:
            raise KeyError(name)
        part, _, rule_name = name.partition(".")
        return replace(self, **{part: replace(getattr(self, part), **{rule_name: neutral})})


USUAL = Rules()
