"""What the page of a run of the blind benchmark says about robots with many joints."""

from collections.abc import Sequence

from wipx.proof.blind.diagnosing import OURS
from wipx.proof.blind.evidence import count_in_words
from wipx.proof.blind.judging import Opened
from wipx.proof.blind_robots.score import CaseScore
from wipx.proof.blind_robots.tree_table import TreeGroup, tree_group, tree_groups
from wipx.report.numbers import significant
from wipx.report.score_page import Table

CAPTION = (
    "Joints exact: of the joints with hidden effects (at the joint, its drive, its sensor or its link), those of which "
    "all are named and none beside them. Site: of the hidden effects, those at whose site mismatch is located. False: "
    "named effects that are not hidden, per 100 joints. Error: of the completed model on unseen recordings over 0.5 s, "
    "over that of the true model, median. Unexplained: of the robots with physics that the vocabulary lacks, those "
    "that were called so."
)
HEAD = (
    "robots",
    "joints exact",
    "effects named",
    "site",
    "false per 100 joints",
    "interval covers",
    "unexplained",
    "error",
    "seconds, median (max)",
    "no answer",
)


def tree_tables(cases: Sequence[Opened]) -> tuple[Table, ...]:
    """Scores of robots with many joints, and of all methods on the same robots; none without such robots."""
    trees = [one for one in cases if one.scores[OURS].tree is not None]
    if not trees:
        return ()
    groups = tree_groups([one.scores[OURS] for one in trees])
    rows = tuple((group.name, *_cells(group)) for group in groups)
    tables = [Table("Robots with many joints", CAPTION, ("what is hidden", *HEAD), rows)]
    names = list(dict.fromkeys(method for one in trees for method in one.scores))
    shared = [one for one in trees if set(one.scores) == set(names)]
    if len(names) > 1 and shared:
        rows = []
        for name in names:
            label = "wipx (this package)" if name == OURS else name.replace("_", " ")
            groups = tree_groups([one.scores[name] for one in shared])
            rows += [(label, group.name, *_cells(group)) for group in groups if "joints" not in group.name]
        head = ("method", "what is hidden", *HEAD)
        title = "Robots with many joints: against what people would use instead"
        tables.append(Table(title, CAPTION, head, tuple(rows)))
    return tuple(tables)


def tree_sentence(scores: Sequence[CaseScore]) -> str:
    """What a reader should take away."""
    trees = [one for one in scores if one.tree is not None and one.outside is None]
    parts = []
    if hidden := [one for one in trees if one.truth]:
        group = tree_group("", hidden)
        parts.append(
            f"Of robots from model files {group.joints.right} of {group.joints.total} joints with hidden effects have "
            f"these named exactly."
        )
    if clean := [one for one in trees if not one.truth]:
        group = tree_group("", clean)
        parts.append(
            f"With nothing missing, {group.false_effects} effects were named at {group.all_joints} joints that are "
            "not there."
        )
    return " ".join(parts)


def tree_row(one: CaseScore) -> str:
    """The score of a robot with many joints in one cell of a table."""
    tree = one.tree
    assert tree is not None
    return (
        f"joints={tree.joints} affected={tree.affected} exact={tree.exact} effects={tree.effects} "
        f"found={tree.found} false={tree.false_effects} sites={tree.sites}"
    )


def _cells(group: TreeGroup) -> tuple[str, ...]:
    return (
        str(group.cases),
        count_in_words(group.joints),
        count_in_words(group.effects),
        count_in_words(group.sites),
        significant(group.false_per_100),
        count_in_words(group.covered),
        count_in_words(group.flagged),
        "-" if group.over_floor is None else significant(group.over_floor),
        f"{group.seconds:.0f} ({group.slowest:.0f})",
        str(group.failures),
    )
