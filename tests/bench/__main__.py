"""One table. `python -m bench [NAME...]`; results go to build/bench.json, and the next run is held against them."""

import importlib.metadata
import json
import math
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from bench.cases import Case, cases, plain

RESULTS = Path(__file__).parents[2] / "build" / "bench.json"
PAIRS, LONGEST_S = 9, 6.0  # as many pairs, or what fits into the time
SLOWER = 1.3  # over the run before: a regression
PACKAGES = ("numpy", "scipy", "pyarrow", "navlib", "magcc", "circuitpython-mag-cal")


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--one"]:
        print(json.dumps(measured(cases()[arguments[1]]())))
        return 0
    before = json.loads(RESULTS.read_text())["cases"] if RESULTS.exists() else {}
    wanted = [name for name in cases() if not arguments or any(a in name for a in arguments)]
    found = {name: in_a_process(name) for name in wanted}
    RESULTS.parent.mkdir(exist_ok=True)
    kept = {"versions": versions(), "at": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "cases": before | found}
    RESULTS.write_text(json.dumps(kept, indent=1))
    show(found, before)
    over = [name for name, one in found.items() if one.get("over")]
    print(f"over their limit: {', '.join(over)}" if over else "every limit is kept")
    return 1 if over else 0


def in_a_process(name: str) -> dict[str, Any]:
    """Measured in a process of its own, so that its peak of memory is its own."""
    run = subprocess.run([sys.executable, "-m", "bench", "--one", name], capture_output=True, text=True, check=False)
    if run.returncode:
        return {"what": name, "failed": run.stderr.strip().splitlines()[-1][:100]}
    return json.loads(run.stdout.splitlines()[-1])


def measured(case: Case) -> dict[str, Any]:
    """Times in pairs with the plain fit of as many rows; memory above that of the data; the error."""
    base, other, floor = plain(case.n), case.run, peak_mb()
    result = case.run()
    base()
    pairs, began = [], time.perf_counter()
    while len(pairs) < PAIRS and (len(pairs) < 1 or time.perf_counter() - began < LONGEST_S):
        pairs.append((seconds_of(other), seconds_of(base)))
    took, beside = np.array(pairs).T
    memory = peak_mb()
    ratio, seconds, error = float(np.median(took / beside)), float(np.median(took)), float(case.error(result))
    limits = ((ratio, case.times), (seconds, case.seconds), (error, case.most))
    over = [value for value, limit in limits if limit is not None and not value <= limit]
    return {
        "what": case.what, "n": case.n, "seconds": seconds, "ratio": ratio, "error": error, "meaning": case.meaning,
        "peak_mb": memory, "above_data_mb": memory - floor, "pairs": len(pairs), "over": bool(over),
        "limits": {"ratio": case.times, "seconds": case.seconds, "error": case.most},
    }  # fmt: skip


def seconds_of(work: Callable[[], Any]) -> float:
    """Of the processor, on one thread: others on the machine then matter little."""
    began = time.process_time()
    work()
    return time.process_time() - began


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def versions() -> dict[str, str]:
    """Of Python, the machine and the packages that were measured."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def show(found: dict[str, dict[str, Any]], before: dict[str, dict[str, Any]]) -> None:
    """The table, and how the time of a diagnosis grows with the rows."""
    table = Table(
        title=f"processor time beside one plain linear least squares of the same rows ({versions()})",
        title_justify="left",
    )
    for head in ("case", "rows", "ms", "x plain", "limit", "run before", "error", "", "peak MB", "verdict"):
        table.add_column(head, justify="left" if head in ("case", "", "verdict") else "right")
    for name, one in found.items():
        if "failed" in one:
            table.add_row(one["what"], "", "", "", "", "", "", one["failed"], "", "")
            continue
        limits, last = one["limits"], before.get(name, {}).get("ratio")
        limit = (
            f"{limits['ratio']:g} x"
            if limits["ratio"]
            else f"{1e3 * limits['seconds']:.0f} ms"
            if limits["seconds"]
            else ""
        )
        verdict = "OVER" if one["over"] else "SLOWER" if last and one["ratio"] > SLOWER * last else ""
        table.add_row(
            one["what"], str(one["n"]), f"{1e3 * one['seconds']:.2f}", f"{one['ratio']:.2f}", limit,
            f"{last:.2f}" if last else "", f"{one['error']:.3g}", one["meaning"], f"{one['peak_mb']:.0f}", verdict,
        )  # fmt: skip
    Console(width=150).print(table)
    times = [(one["n"], one["seconds"]) for name, one in found.items() if name.startswith("diagnose") and "n" in one]
    for (n, short), (more, long) in pairwise(times):
        print(f"diagnose, {n} to {more} rows: time grows as rows^{math.log(long / short) / math.log(more / n):.2f}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
