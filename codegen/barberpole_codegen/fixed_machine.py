"""Registers and instructions of a fixed-point program as they come about: sums, products, quotients and roots.

Each method returns where the result stands, the interval it can reach and the bound on its error; firmware/bp_fixed.py
holds the three instructions. See fixed.py for the number format.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from barberpole.errors import LimitError, must

from barberpole_codegen.fixed import ADD_OP, BITS, MUL_OP, SLACK, SUB_OP, Fixed, Instruction, Interval, exponent

WIDEST_SHIFT = 31
LEFT_SHIFT = 15
ENOUGH = 2.0**-33  # relative error of a Newton step that is not followed by another
STEEPEST = 64.0  # largest over smallest value of what is divided by: more would need many steps
STEEPEST_ROOT = 40.0  # the same of what a root is taken of, where a first guess beyond 50 leads nowhere


@dataclass
class Machine:
    """Registers and instructions so far."""

    registers: int = 0
    instructions: list[Instruction] = field(default_factory=list)
    constants: dict[int, int] = field(default_factory=dict)
    _known: dict[tuple[int, int], Fixed] = field(default_factory=dict)
    _roots: dict[tuple[int, int], Fixed] = field(default_factory=dict)
    _inverses: dict[tuple[int, int], Fixed] = field(default_factory=dict)

    def register(self, interval: Interval, k: int, error: float) -> Fixed:
        self.registers += 1
        return Fixed(self.registers - 1, k, interval, error)

    def constant(self, value: float) -> Fixed:
        k = exponent(abs(value) * SLACK)
        n = round(value * 2.0 ** (BITS - k))
        if (n, k) not in self._known:
            made = self.register(Interval(value, value), k, abs(value - n * 2.0 ** (k - BITS)))
            self.constants[made.register] = n
            self._known[n, k] = made
        return self._known[n, k]

    def add(self, a: Fixed, b: Fixed, operation: int, interval: Interval | None = None) -> Fixed:
        sign = 1 if operation == ADD_OP else -1
        low, high = sorted((sign * b.interval.low, sign * b.interval.high))
        interval = interval or Interval(a.interval.low + low, a.interval.high + high)
        widest = max(a.k, b.k)
        own = 2.0 ** (widest + 1 - BITS) * ((a.k != widest + 1) + (b.k != widest + 1))
        work = max(widest, exponent((interval.largest + a.error + b.error + own) * SLACK))
        shifts = min(work - a.k, WIDEST_SHIFT), min(work - b.k, WIDEST_SHIFT)
        error = a.error + b.error + 2.0 ** (work - BITS) * sum(shift > 0 for shift in shifts)
        k = max(exponent((interval.largest + error) * SLACK), work - LEFT_SHIFT)
        made = self.register(interval, k, error)
        self.instructions.append(Instruction(operation, made.register, a.register, b.register, *shifts, work - k))
        return made

    def mul(self, a: Fixed, b: Fixed, interval: Interval | None = None) -> Fixed:
        interval = interval or _product(a, b)
        propagated = a.interval.largest * b.error + b.interval.largest * a.error + a.error * b.error
        widest = a.k + b.k
        k = exponent((interval.largest + propagated) * SLACK)
        while (interval.largest + propagated + 2.0 ** (k - BITS)) * SLACK >= 2.0**k:
            k += 1
        k = max(min(k, widest), widest - LEFT_SHIFT)
        made = self.register(interval, k, propagated + 2.0 ** (k - BITS))
        self.instructions.append(Instruction(MUL_OP, made.register, a.register, b.register, left=widest - k))
        return made

    def scaled(self, a: Fixed, factor: float) -> Fixed:
        """Times a constant; nothing is done for a power of two, whose product only reads the register differently."""
        mantissa, power = math.frexp(abs(factor))
        if mantissa != 0.5:
            return self.mul(a, self.constant(factor))
        times = abs(factor)
        made = replace(a, k=a.k + power - 1, interval=_times(a.interval, times), error=a.error * times)
        return made if factor > 0 else self.add(self.constant(0.0), made, SUB_OP)

    def inverse(self, b: Fixed) -> Fixed:
        """1 / b: y <- y (2 - b y), whose relative error is the square of the last one."""
        if (b.register, b.k) not in self._inverses:
            self._inverses[b.register, b.k] = self._inverse(b)
        return self._inverses[b.register, b.k]

    def _inverse(self, b: Fixed) -> Fixed:
        if b.interval.high < 0:
            return self.scaled(self._inverse(self.scaled(b, -1.0)), -1.0)
        low, high = _positive(b, "what is divided by", STEEPEST)
        total, apart = low + high, high - low
        scale = 8.0 / (2.0 * total**2 - apart**2)
        off = apart**2 * scale / 8.0  # Chebyshev: 1 - b y0 = off T2
        y = self._line(scale * total, scale, b, Interval((1 - off) / high, (1 + off) / low))
        two, largest = self.constant(2.0), (1 + off) / low
        while True:
            off += y.error * high
            t = self.mul(b, y, Interval(1 - off, 1 + off))
            w = self.add(two, t, SUB_OP, Interval(1 - off, 1 + off))
            rounding = largest * (t.unit + (w.error - t.error))
            off = off**2 * SLACK
            y = self.mul(y, w, Interval((1 - off) / high, (1 + off) / low))
            y = replace(y, error=rounding + y.unit)
            if off < ENOUGH:
                return replace(y, error=y.error + off / low + b.error / low**2)

    def inverse_root(self, s: Fixed) -> Fixed:
        """1 / sqrt(s): y <- y (3/2 - s y^2 / 2), whose relative error is 3/2 of the square of the last one."""
        if (s.register, s.k) not in self._roots:
            self._roots[s.register, s.k] = self._inverse_root(s)
        return self._roots[s.register, s.k]

    def _inverse_root(self, s: Fixed) -> Fixed:
        low, high = _positive(s, "what a root is taken of", STEEPEST_ROOT)
        start, slope, off = _line_to_inverse_root(low, high)
        within = low**-0.5, high**-0.5
        y = self._line(start, slope, s, Interval((1 - off) * within[1], (1 + off) * within[0]))
        half, one_and_half = self.scaled(s, 0.5), self.constant(1.5)
        while True:
            off += y.error * high**0.5
            square = self.mul(y, y, _times(Interval((1 - off) ** 2, (1 + off) ** 2), 1.0 / high, 1.0 / low))
            t = self.mul(half, square, Interval(0.5 * (1 - off) ** 2, 0.5 * (1 + off) ** 2))
            w = self.add(one_and_half, t, SUB_OP, Interval(1 - 2 * off, 1 + 2 * off))
            rounding = within[0] * (1 + off) * (0.5 * high * square.unit + t.unit + (w.error - t.error))
            off = (1.5 + off) * off**2 * SLACK
            y = self.mul(y, w, Interval((1 - off) * within[1], (1 + off) * within[0]))
            y = replace(y, error=rounding + y.unit)
            if off < ENOUGH:
                return replace(y, error=y.error + off * within[0] + 0.5 * s.error * low**-1.5)

    def _line(self, start: float, slope: float, b: Fixed, interval: Interval) -> Fixed:
        made = self.add(self.constant(start), self.mul(b, self.constant(slope)), SUB_OP)
        return replace(made, interval=interval)


def _times(interval: Interval, low: float, high: float | None = None) -> Interval:
    return Interval(interval.low * low, interval.high * (low if high is None else high))


def _product(a: Fixed, b: Fixed) -> Interval:
    (al, ah), (bl, bh) = (a.interval.low, a.interval.high), (b.interval.low, b.interval.high)
    if a.register == b.register:  # a square, perhaps times a power of two
        return Interval(0.0 if al <= 0 <= ah else min(al * bl, ah * bh), max(al * bl, ah * bh))
    corners = (al * bl, al * bh, ah * bl, ah * bh)
    return Interval(min(corners), max(corners))


def _positive(b: Fixed, what: str, steepest: float) -> tuple[float, float]:
    low, high = b.interval.low - b.error, b.interval.high + b.error
    if not (low > 0 and high < steepest * low):
        be = f"away from zero, within a factor {steepest:g}"
        raise LimitError(must(what, be, f"{low:.3g} to {high:.3g}", "fixed point"))
    return low, high


def _line_to_inverse_root(low: float, high: float) -> tuple[float, float, float]:
    """start, slope and largest relative error of start - slope s as 1/sqrt(s): its ends as far off as its middle."""
    a, b = low**-0.5, high**-0.5
    slope = (a - b) / (high - low) if high > low else 0.5 * low**-1.5
    start = a + slope * low
    s = np.linspace(low, high, 1001)
    y = (start - slope * s) * np.sqrt(s)  # at least 1: a chord lies above a convex curve
    down = 2.0 / (1.0 + float(y.max()))
    return start * down, slope * down, abs(1.0 - down) + 1e-6
