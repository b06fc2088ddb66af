# bp_givens.py: streaming least squares by Givens rotations, one triangle shared by all right-hand sides.
# Each row [regressors | right-hand sides] is rotated into the triangle and forgotten; what is left of its right-hand
# sides is residual. Regressors must be scaled to about 1. The state is float32 on every port, as on the STM32F4:
# there the error of a solution is about 3e-7 of full scale, against 3e-6 of statistics in a typical run.
import math
from array import array


class Givens:
    def __init__(self, p, m):  # p regressors, m right-hand sides
        self.p = p
        self.m = m
        self.n = 0
        self.row = array("f", bytearray(4 * (p + m)))  # fill it, then add()
        self.rss = array("f", bytearray(4 * m))  # residual sum of squares of each right-hand side
        self._r = array("f", bytearray(4 * p * (p + m)))

    def add(self):  # takes self.row, and destroys it
        r, row, width = self._r, self.row, self.p + self.m
        for i in range(self.p):
            x = row[i]
            if x != 0.0:
                diagonal = r[i * width + i]
                length = math.sqrt(diagonal * diagonal + x * x)
                r[i * width + i] = length
                self._rotate(i, diagonal / length, x / length)
        for k in range(self.m):
            rest = row[self.p + k]
            self.rss[k] += rest * rest
        self.n += 1

    def _rotate(self, i, c, s):  # row i of the triangle and the new row, right of column i
        r, row, width = self._r, self.row, self.p + self.m
        at = i * width
        for j in range(i + 1, width):
            u = r[at + j]
            v = row[j]
            r[at + j] = c * u + s * v
            row[j] = c * v - s * u

    def solve(self, k):  # the p unknowns of right-hand side k; ZeroDivisionError if the rows do not determine them
        p, r, width = self.p, self._r, self.p + self.m
        x = [0.0] * p
        for i in range(p - 1, -1, -1):
            rest = r[i * width + p + k]
            for j in range(i + 1, p):
                rest -= r[i * width + j] * x[j]
            x[i] = rest / r[i * width + i]
        return x
