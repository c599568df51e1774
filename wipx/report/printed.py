"""The figures that the paper prints, and where ours of the same kind stand in the tables."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from wipx.report.estimation_tables import PRINTED_ESTIMATORS, PRINTED_LATENCY, PRINTED_METHODS
from wipx.report.numbers import MISSING
from wipx.report.table import Table

HEAD = ("printed in", "figure", "paper", "ours", "comparable", "why")
ANOTHER_ROBOT = "another robot: ours is emulated, theirs is not public"
RMSE = (
    f"{ANOTHER_ROBOT}. The paper prints 'MSE (rad)'; read as rad^2 it would be an error as large as the "
    "pitches, so it is compared with the root mean squared error in rad"
)


@dataclass(frozen=True)
class Printed:
    """One figure of the paper.

    Attributes:
        place: Where it is printed.
        figure: What it says.
        paper: Its value, with its unit.
        part: Name of the part whose tables hold ours; empty where nothing of ours is like it.
        row: First cells of the row that does.
        column: Of ours in that row.
        comparable: "yes", "in part" or "no".
        why: Reason.
    """

    place: str
    figure: str
    paper: str
    part: str
    row: tuple[str, ...]
    column: int
    comparable: str
    why: str


def printed_figures() -> Iterator[Printed]:
    """All figures that the paper prints as results."""
    yield from _estimates()
    yield from _control()
    yield from _optimizers()


def comparison(tables: Mapping[str, Sequence[Table]]) -> Table:
    """The paper's figures beside ours.

    Args:
        tables: Of the parts that were made, by the part's name.
    """
    rows, before = [], ""
    for one in printed_figures():
        found = (table.cell(one.row, one.column) for table in tables.get(one.part, ()) if one.row)
        ours = next((cell for cell in found if cell is not None), MISSING if one.part else "none")
        why = "as above" if one.why == before else one.why
        rows.append((one.place, one.figure, one.paper, ours, one.comparable, why))
        before = one.why
    return Table(HEAD, tuple(rows), (2, 3))


def _estimates() -> Iterator[Printed]:
    for method, (sim, real) in PRINTED_METHODS.items():
        for column, name, value in ((2, "Sim", sim), (3, "Real", real)):
            what = f"error of the estimated pitch, {method}, {name}"
            yield Printed("Table I", what, f"{value:.3f}", "methods", (method,), column, "in part", RMSE)
        difference = f"{abs(real - sim):.3f}"
        what = f"difference of Real and Sim, {method}"
        yield Printed("Table I", what, difference, "methods", (method,), 4, "in part", RMSE)
    for estimator, lengths in PRINTED_ESTIMATORS.items():
        for length, (sim, real) in lengths.items():
            for column, name, value in ((2, "Sim", sim), (3, "Real", real)):
                what = f"error of the estimated pitch, {estimator}, {length} samples, {name}"
                row = (estimator, str(length))
                yield Printed("Table II", what, f"{value:.3f}", "estimators", row, column, "in part", RMSE)
        why = "another computer; ours is one thread of onnxruntime, theirs is not said"
        latency = f"{1e3 * PRINTED_LATENCY[estimator]:g} ms"
        what = f"time of one estimate [ms], {estimator}, 80 samples"
        yield Printed("Table II", what, latency, "estimators", (estimator, "80"), 6, "no", why)


def _control() -> Iterator[Printed]:
    stopped = (
        f"{ANOTHER_ROBOT}, with another rail. Errors of a robot that stands at the end of its rail depend on "
        "the rail's length"
    )
    for task, (position, pitch) in {"balancing": (38, 23), "tracking": (77, 60)}.items():
        what = f"{task}: position error of ours below the baseline's [%]"
        yield Printed("Sec. VI-B", what, str(position), "control", (task, "all"), 4, "in part", stopped)
        why = f"{stopped}. The text says angular velocity, its lists and figures say angular position"
        what = f"{task}: pitch error from the target, of ours below the baseline's [%]"
        yield Printed("Sec. VI-B", what, str(pitch), "control", (task, "all"), 8, "in part", why)
    why = "the paper lists six figures for five payloads, and does not say which belongs to which"
    for task, figures in {
        "balancing": "24.34, 40.87, 35.29, 52.60, 31.24, 47.51",
        "tracking": "66.5, 74.9, 85.9, 59.6, 88.1, 90.7",
    }.items():
        yield Printed("Sec. VI-B", f"{task}: position, each payload [%]", figures, "", (), 0, "no", why)
    why = f"{ANOTHER_ROBOT}, and the paper does not say what counts as recovered"
    what = "balancing: ours finds the new balance in about [s]"
    yield Printed("Fig. 6", what, "1", "control", ("balancing", "all"), 10, "in part", why)


def _optimizers() -> Iterator[Printed]:
    why = "another problem and budget. Ours succeeds within 1 % of the best loss that any search found"
    for name in ("ga", "pso", "nelder_mead", "powell", "cg", "bfgs", "slsqp"):
        word = "succeeds" if name in ("ga", "pso") else "fails"
        yield Printed("Sec. VI-C", f"optimizer {name}", word, "optimizers", (name,), 1, "in part", why)
    why = "curves without numbers; ours are in the figure of the part optimizers"
    yield Printed("Fig. 8", "loss of GA and PSO over time", "curves", "", (), 0, "no", why)
    why = "curves without numbers; ours are in the figure of the part trajectories"
    yield Printed("Fig. 4", "trajectories of the five methods", "curves", "", (), 0, "no", why)
    why = "the same law with the printed numbers; the figure of the part friction"
    yield Printed("Fig. 3", "friction of Eq. 5 with zeta", "curve", "friction", (), 0, "yes", why)
