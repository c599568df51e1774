"""The page `docs/rules.md`: `python -m wipx.diagnosis.rules_page > docs/rules.md` writes it anew."""

from dataclasses import fields

from wipx.diagnosis.rules import USUAL

HEAD = """# Rules

Every number that decides an answer of `task=diagnose`. The group `diagnosis` of the configuration holds them, so that a
single rule is changed like any other setting:

    python -m wipx task=diagnose recordings.path=FOLDER diagnosis.selection.least_share=0.02

*Neutral* is the value with which a rule decides nothing; `+experiment=ablation_rules` leaves out one rule at a time and
counts what each is worth. The sizes at which a law amounts to a simpler one stand with the law, in `wipx/effects`.

This page is generated: `python -m wipx.diagnosis.rules_page > docs/rules.md`.
"""
COLUMNS = "| rule | value | unit | meaning | origin | neutral |\n| --- | ---: | --- | --- | --- | ---: |"


def page() -> str:
    """The rules as Markdown, a table for each part."""
    notes = list(USUAL.each())
    sections = [HEAD]
    for part in fields(USUAL):
        rows = [
            f"| `{name.partition('.')[2]}` | {value:g} | {note.unit or '-'} | {note.meaning} | {note.origin} "
            f"| {'-' if note.neutral is None else f'{note.neutral:g}'} |"
            for name, value, note in notes
            if name.startswith(f"{part.name}.")
        ]
        purpose = (type(getattr(USUAL, part.name)).__doc__ or "").splitlines()[0]
        sections.append("\n".join([f"## diagnosis.{part.name}", "", purpose, "", COLUMNS, *rows, ""]))
    return "\n".join(sections)


if __name__ == "__main__":
    print(page(), end="")
