"""One table in several forms, and the page that sets the paper's figures beside ours."""

from pathlib import Path

import pytest

from wipx.report.estimation_tables import METHODS_HEAD
from wipx.report.printed import comparison, printed_figures
from wipx.report.table import Table, tables_in
from wipx.report.tables import markdown
from wipx.report.tables_page import write_tables_page

ROWS = (("ours", "2", "0.011 +- 0.001", "0.021", "0.010", "1e-4", "4e-4", "90 %", "0.024, 0.023"),)


def test_a_table_that_was_written_is_read_back_the_same():
    head, rows = ("a", "c"), (("<x> & y|z", "1.5"), ("", "-"))
    (read,) = tables_in(f"Text before.\n\n{markdown(head, rows, (1,))}\nText after.\n")
    assert read == Table(head, rows, (1,))


def test_all_tables_of_a_text_are_read_in_their_order():
    first, second = markdown(("a",), [("1",)], ()), markdown(("b",), [("2",)], ())
    assert [table.head for table in tables_in(f"{first}\n{second}")] == [("a",), ("b",)]


def test_the_papers_figures_stand_beside_ours_each_with_a_reason():
    compared = comparison({"methods": [Table(METHODS_HEAD, ROWS)]})
    (row,) = [row for row in compared.rows if "ours, Real" in row[1] and row[0] == "Table I"]
    assert row[2:4] == ("0.023", "0.021")
    assert all(row[4] in ("yes", "in part", "no") and row[5] for row in compared.rows)
    assert sum(one.place == "Table II" for one in printed_figures()) == 5 * 4 * 2 + 5


@pytest.mark.slow
def test_the_page_has_every_part_and_says_what_could_not_be_made(tmp_path: Path):
    (tmp_path / "methods").mkdir()
    (tmp_path / "methods" / "table.md").write_text(markdown(METHODS_HEAD, ROWS, (4,)))
    (tmp_path / "methods" / "estimates.png").write_bytes(b"")
    (tmp_path / "real").mkdir()
    write_tables_page(tmp_path, ("methods", "real", "blind"), {"real": "recordings are missing"})
    page = (tmp_path / "index.html").read_text()
    assert "recordings are missing" in page
    assert '<img src="methods/estimates.png"' in page
    assert "0.011 +- 0.001" in page
    assert (tmp_path / "methods" / "table1.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "comparison.tex").is_file()
    assert (tmp_path / "comparison.png").is_file()
