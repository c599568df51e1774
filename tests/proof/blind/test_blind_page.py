"""The page of a run of the blind benchmark says what was scored, at a glance and in full."""

import json
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from wipx.proof.blind.diagnosing import OURS
from wipx.proof.blind.evidence import Account
from wipx.proof.blind.judging import Opened
from wipx.proof.blind.page import score_page_of
from wipx.proof.blind_robots.folder import RunFolder
from wipx.proof.blind_robots.score import CaseScore, ParameterScore
from wipx.report.score_page import Link, score_markdown, score_page

HOSTILE = "</script><b>&|"
ACCOUNT = Account(seed=3, given=False, pauses=0, drawn=5)


def scored(case: str, tier: str, *truth: str, answer: tuple[str, ...] | None = None, **more) -> CaseScore:
    given = truth if answer is None else answer
    return replace(
        CaseScore(
            case=case,
            tier=tier,
            plant="wip",
            truth=truth,
            outside=None,
            contrast=20.0 if truth else None,
            answer=given,
            verdict="mismatch" if given else "consistent",
            exact=given == truth,
            false_alarms=len(set(given) - set(truth)),
            verdict_right=bool(given) == bool(truth),
            site_right=True if truth else None,
            region_error=None,
            time_error=None,
            parameters=tuple(ParameterScore(f"{name}.sigma", 1.0, 1.01, 0.9, 1.1) for name in truth),
            flagged=None,
            aliased=None,
            removed=0.99 if truth else None,
            over_floor=1.1,
            seconds=12.0,
        ),
        **more,
    )


SCORES = (
    scored("case0001", "nothing"),
    scored("case0002", "single_clear", "pitch/viscous"),
    scored("case0003", "nothing", answer=("translation/coulomb",)),
    scored("case0004", "outside", outside="sloshing", exact=None, verdict="unexplained", flagged=True, aliased=False),
    scored("case0005", "pair", "pitch/viscous", "actuator/delay", answer=("pitch/viscous",)),
)


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    run = RunFolder(tmp_path)
    run.commitments.write_text(json.dumps({"schema": 1, "written": "2030-01-01T00:00:00Z", "cases": []}))
    answer = {"sha256": "", "seconds": 1.0, "failure": "", "opened": 9, "refused": ["/run/sealed/case0002.seal"]}
    for one in SCORES:
        run.answers(one.case).parent.mkdir(parents=True)
        content = {"schema": 1, "written": "2030-01-01T00:00:09Z", "answers": {OURS: answer}}
        run.answers(one.case).write_text(json.dumps(content))
    return run


def cases(*more: tuple[str, CaseScore]) -> list[Opened]:
    opened = [Opened(one.case, "key", {OURS: one}, {OURS: None}) for one in SCORES]
    for method, score in more:
        place = next(index for index, one in enumerate(opened) if one.case == score.case)
        opened[place] = replace(opened[place], scores={**opened[place].scores, method: score})
    return opened


def test_the_headline_tells_what_was_found_and_what_was_not(folder: RunFolder):
    page = score_page_of(folder, cases(), ACCOUNT)
    assert page.headline == (
        "Physics was hidden in 2 robots and named exactly in 1. Nothing was missing in 2 robots: 1 false alarm. "
        "In 1 robot it was physics that the vocabulary lacks: 1 called unexplained."
    )
    assert [tile.worse for tile in page.tiles] == [False, True, False, False]


def test_the_headline_says_why_a_robot_has_no_answer(folder: RunFolder):
    opened = cases()
    silent = replace(SCORES[1], answer=(), exact=False, verdict="", failure="no answer within 900 s")
    opened[1] = replace(opened[1], scores={OURS: silent})
    assert score_page_of(folder, opened, ACCOUNT).headline.endswith(
        "No answer for 1 robot (case0002: no answer within 900 s)."
    )


def test_misses_lead_to_their_reports_false_alarms_first(folder: RunFolder):
    rows = score_page_of(folder, cases(), ACCOUNT).misses.rows
    assert [row[0] for row in rows] == [
        Link("case0003", "answers/case0003/wipx/report.html"),
        Link("case0005", "answers/case0005/wipx/report.html"),
    ]


def test_what_was_refused_stands_on_the_page(folder: RunFolder):
    proof = dict(score_page_of(folder, cases(), ACCOUNT).proof)
    assert "/run/sealed/case0002.seal" in proof["Watched"]
    assert "2030-01-01T00:00:00Z, the first answer at 2030-01-01T00:00:09Z" in proof["Fixed in advance"]


def test_methods_are_compared_on_the_same_cases(folder: RunFolder):
    assert score_page_of(folder, cases(), ACCOUNT).methods is None
    baseline = scored("case0002", "single_clear", "pitch/viscous", answer=("pitch/coulomb", "pitch/viscous"))
    table = score_page_of(folder, cases(("regression", baseline)), ACCOUNT).methods
    assert table is not None
    ours, theirs = (dict(zip(table.head, row, strict=True)) for row in table.rows)
    assert ours["names right"] == "1 of 1\n3 to 100 %"
    assert theirs["names right"] == "0 of 1\n0 to 98 %"
    assert theirs["false alarms"] == "1 of 1\n3 to 100 %"


def test_markdown_has_the_tables_with_links_or_without(folder: RunFolder):
    page = score_page_of(folder, cases(), ACCOUNT)
    assert "[case0003](answers/case0003/wipx/report.html)" in score_markdown(page)
    plain = score_markdown(page, links=False)
    assert "| case0003 | nothing |" in plain
    assert "](" not in plain


def test_hostile_texts_stay_text(folder: RunFolder):
    baseline = replace(SCORES[1], failure=HOSTILE)
    page = score_page_of(folder, cases((HOSTILE, baseline)), ACCOUNT)
    text = score_page(page)
    assert HOSTILE not in text
    assert HOSTILE in unescape(text)
    assert "</script>" not in score_markdown(page)
