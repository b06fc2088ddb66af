"""host/docs/limits.md, written from the outcomes."""

import re

from barberpole.limits.judge import Outcome, table

INTRODUCTION = """# What bad data do

Fifteen ways in which a recording goes wrong, tried on the fit under each reference, on every published method and on
the diagnosis. Written by `make docs` from what really came out (`python -m barberpole.limits` prints it); a test
compares.

* **right**: every figure is within its stated error of the truth, however wide that error had to become; figures
  without a stated error agree to 2 %. Of a diagnosis: nothing was named that is not there.
* **refused**: no figure, but the reason and what to do next; the sentences are below.
* **–**: does not show in such data. At null field a dead axis, a wrong unit or a second field change nothing.

Never finite, confident and wrong. Of 29 routines elsewhere 15 to 25 were, on data of this kind.
"""
MARKS = {"does not apply": "–"}


def page(outcomes: dict[str, dict[str, Outcome]] | None = None) -> str:
    """The whole page in Markdown."""
    found = outcomes or table()
    return "\n".join([INTRODUCTION, *outcome_table(found), "", "## What the refusals say", "", *refusals(found)]) + "\n"


def outcome_table(found: dict[str, dict[str, Outcome]]) -> list[str]:
    """Lines of the table: cases down, ways across."""
    ways = list(next(iter(found.values())))
    lines = ["| | " + " | ".join(way.removeprefix("--method ") for way in ways) + " |", "|---" * (len(ways) + 1) + "|"]
    for case, row in found.items():
        lines.append(f"| **{case}** | " + " | ".join(MARKS.get(row[w].said, row[w].said) for w in ways) + " |")
    return lines


def refusals(found: dict[str, dict[str, Outcome]]) -> list[str]:
    """Lines of each case's sentences, with who says them."""
    lines = []
    for case, row in found.items():
        said: dict[str, list[str]] = {}
        for way, outcome in row.items():
            if outcome.said == "refused":
                said.setdefault(_plain(outcome.why), []).append(way.removeprefix("--method "))
        if said:
            lines += [f"**{case}**", ""]
            lines += [f"* {why} — *{', '.join(ways)}*" for why, ways in said.items()] + [""]
    return lines


def _plain(sentence: str) -> str:
    """The sentence without the place of a temporary file."""
    return re.sub(r" \(/[^)]*\)|, */[^ ,]*", "", sentence).replace("|", "\\|")
