"""`fleet report`: a fleet as one page: what its boards share, which stand out and why, which have changed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from barberpole import __version__
from barberpole.figures.figure import Figure, listed, plot
from barberpole.figures.theme import BLUE, GREY, VERMILLION
from barberpole.fleet.lots import LotEffect
from barberpole.fleet.spread import Row, Spread
from barberpole.fleet.summary import Change, Outlier, Summary
from barberpole.fleet.table import Fleet
from barberpole.report.page import Section, Table, write_page

LISTED = 20  # rows of a table
DRAWN = 6  # boards whose changes are drawn
KINDS = {
    "common": "no difference between boards is seen",
    "alike": "boards differ, by less than the noise of one reading",
    "individual": "boards differ by more than the noise of a reading: calibrate each",
}


def write_fleet_report(found: Summary, fleet: Fleet, path: Path) -> None:
    """Write the page; its numbers are those of `fleet report --json`."""
    rows = fleet.latest()
    parts = [_lots(found), _outliers(found.outliers), _changes(found.changes), _shared(found.parameters)]
    sections = [part for part in (*parts, *_distributions(found, rows), _failed(found)) if part]
    provenance = f"barberpole {__version__}\nrepeat it: barberpole fleet report {fleet.path.name} -o {path.name}"
    good = not (found.outliers or found.changes or found.failed or any(found.lots.values()))
    title = f"{fleet.path.name}: {found.boards} boards"
    write_page(path, title, verdict(found), "good" if good else "bad", sections, provenance, found.to_json())


def verdict(found: Summary) -> str:
    """The fleet in a sentence or two."""
    standing, changed = {one.board for one in found.outliers}, {one.board for one in found.changes}
    said = [f"Boards that stand out: {len(standing)} of {found.boards}", f"changed: {len(changed)}"]
    said += [f"logs that could not be used: {len(found.failed)} of {found.logs}"] if found.failed else []
    effects = [f"lot {lot} shares {one.effect}" for lot, these in found.lots.items() for one in these]
    return f"{'; '.join([*said, *effects])}."


def _lots(found: Summary) -> Section | None:
    if not found.lots:
        return None
    rows = [_lot_row(lot, one) for lot, effects in found.lots.items() for one in effects]
    quiet = [lot for lot, effects in found.lots.items() if not effects]
    said = "The scores of all boards, added up, find what is too small to see on one."
    said += f" Nothing is shared by {listed(quiet)}." if quiet else ""
    said += " Put the effect into the model and diagnose the fleet again." if rows else ""
    head = ("lot", "effect", "boards", "how", "of the noise", "gain", "cannot be told from", "the lot's mean")
    tables = [Table(head, rows)] if rows else []
    return Section("What does a whole lot share?", said, (), tables, mark="bad" if rows else "good")


def _lot_row(lot: str, one: LotEffect) -> tuple[str, ...]:
    means = ", ".join(f"{name} {value:.3g} ± {error:.1g}" for name, (value, error) in one.parameters.items())
    size, gain = f"{one.size:.2g}", f"{one.gain:.0f}"
    return (lot, one.effect, str(one.boards), one.kind, size, gain, listed(one.rivals), means if one.common else "")


def _outliers(found: Sequence[Outlier]) -> Section:
    rows = [(one.board, one.why, f"{one.z:+.1f}") for one in found[:LISTED]]
    said = f"Boards: {len({one.board for one in found})}, figures: {len(found)}." if found else "None does."
    said += " The distance counts the lot's own scatter and the uncertainty of the board."
    tables = [Table(("board", "why", "standard deviations"), rows)] if rows else []
    return Section("Which boards stand out?", said, (), tables, mark="bad" if rows else "good")


def _changes(found: Sequence[Change]) -> Section:
    rows = [(one.board, one.why, f"{one.p_value:.1e}") for one in found[:LISTED]]
    said = "None that was calibrated more than once has."
    if found:
        said = f"Boards: {len({one.board for one in found})}. Their calibrations differ by more than their errors."
    tables = [Table(("board", "what", "chance"), rows)] if rows else []
    return Section("Which boards have changed?", said, [_change(one) for one in found[:DRAWN]], tables)


def _change(one: Change) -> Figure:
    dated = all(one.dates)
    x = list(one.dates) if dated else [Path(log).stem for log in one.logs]
    drawn = plot("date" if dated else "calibration", f"{one.parameter}, {one.unit}", 260)
    bars = {"type": "data", "array": [2 * error for error in one.errors], "thickness": 1.5}
    drawn.add_trace(go.Scatter(x=x, y=list(one.values), error_y=bars, mode="lines+markers", line={"color": BLUE}))
    return Figure(drawn, f"{one.board}: {one.parameter}", f"{one.why}. Bars are two standard errors.")


def _shared(found: Sequence[Spread]) -> Section | None:
    if not found:
        return None
    head = ("parameter", "mean", "between boards", "its interval", "own error", "readings off by", "it is")
    rows = [
        (
            one.name,
            f"{one.mean:.4g} {one.unit}",
            f"{one.tau:.3g}",
            f"{one.interval[0]:.2g} to {one.interval[1]:.2g}",
            f"{one.stderr:.2g}",
            f"{one.error_lsb:.3g} LSB",
            one.kind,
        )
        for one in found
    ]
    said = "; ".join(f"{kind}: {meaning}" for kind, meaning in KINDS.items())
    said = f"What is common or alike may be taken from the lot. {said[0].upper()}{said[1:]}."
    said += f" One reading has {found[0].noise_lsb:.3g} LSB of noise."
    return Section("What is common to all boards, and what is individual?", said, (), [Table(head, rows)])


def _distributions(found: Summary, rows: Sequence[Row]) -> list[Section]:
    if not found.parameters:
        return []
    far = {(one.board, one.what) for one in found.outliers}
    figures = [_distribution(one, rows, far) for one in found.parameters]
    return [Section("How do the parameters scatter?", "Boards that stand out are marked.", figures)]


def _distribution(one: Spread, rows: Sequence[Row], far: set[tuple[str, str]]) -> Figure:
    having = [row for row in rows if None not in row["parameters"].get(one.name, [None])]
    values = np.array([row["parameters"][one.name][0] for row in having])
    drawn = plot(f"{one.name}, {one.unit}", "boards", 240)
    drawn.add_trace(
        go.Histogram(x=values, nbinsx=int(10 + np.sqrt(values.size)), marker={"color": BLUE}, name="boards")
    )
    out = [(v, row["board"]) for v, row in zip(values, having, strict=True) if (row["board"], one.name) in far]
    if out:
        marks = {"color": VERMILLION, "size": 10, "symbol": "triangle-down"}
        x, names = [v for v, _ in out], [board for _, board in out]
        drawn.add_trace(go.Scatter(x=x, y=[1] * len(x), text=names, mode="markers", marker=marks, name="stands out"))
    drawn.add_vline(x=one.mean, line={"color": GREY, "dash": "dash"})
    drawn.update_layout(showlegend=False)
    said = f"{one.kind}: the boards scatter by {one.tau:.3g} {one.unit}, each is known to {one.stderr:.2g} {one.unit}."
    return Figure(drawn, one.name, said)


def _failed(found: Summary) -> Section | None:
    if not found.failed:
        return None
    rows = [(one["log"], one["reason"]) for one in found.failed[:LISTED]]
    said = f"{len(found.failed)} of {found.logs}."
    return Section("Which logs could not be used?", said, (), [Table(("log", "reason"), rows)], mark="bad")
