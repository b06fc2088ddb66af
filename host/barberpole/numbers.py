"""Numbers as people read them, and as JSON holds them."""

import math
from typing import Any

LEAST_CHANCE = 1e-300  # where p-values are cut off: smaller ones are lost in a float


def plain(value: float | None, digits: int = 4) -> str:
    """Significant figures without an exponent from 0.0001 up to a million: 303200, 0.00123, 1.2e+09."""
    if value is None or not math.isfinite(value):
        return "not known"
    if value == 0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")
    if not 1e-4 <= abs(rounded) < 1e6:
        return f"{value:.{digits}g}"
    after = max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)
    text = f"{rounded:.{after}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def signed(value: float, digits: int = 3) -> str:
    """The same with its sign: +38, -0.2."""
    return plain(value, digits) if value < 0 or not math.isfinite(value) else f"+{plain(value, digits)}"


def uncertain(value: float, stderr: float) -> str:
    """A value to the digits that its error leaves: "65.72 ± 0.03"."""
    if not math.isfinite(stderr) or stderr <= 0:
        return plain(value)
    digits = max(0, 1 - math.floor(math.log10(stderr)))
    if digits > 7:
        return f"{value:.6g} ± {stderr:.2g}"
    return f"{value:.{digits}f} ± {stderr:.{digits}f}"


def with_error(value: float, stderr: float) -> tuple[str, str]:
    """The same as two cells of a table, two figures of the error: ("2820", "120"), ("0.00293", "0.00061").

    A value below its error keeps two figures of its own.
    """
    if not math.isfinite(stderr) or stderr <= 0:
        return f"{value:.6g}", ""
    size = math.floor(math.log10(abs(value))) if value else 0
    of_error = 1 - math.floor(math.log10(stderr))
    figures = max(of_error, 1 - size) if value else of_error
    if not -4 <= figures <= 7:
        return f"{value:.{max(figures + size + 1, 1)}g}", f"{stderr:.2g}"
    return f"{round(value, figures):.{max(figures, 0)}f}", f"{round(stderr, of_error):.{max(of_error, 0)}f}"


def chance(p_value: float) -> str:
    """A p-value; none is told below the least that a diagnosis computes."""
    return "<1e-300" if p_value <= LEAST_CHANCE else f"{p_value:.1e}"


def strict(value: Any) -> Any:
    """What strict JSON can hold: numpy's numbers become plain, and what is not a finite number becomes null."""
    if isinstance(value, dict):
        return {key: strict(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [strict(inner) for inner in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
