"""Two-step scalar calibration (thesis 4.8-4.20): the closed form that every scalar fit starts from, by its name."""

from barberpole.fit.ellipsoid import Ellipsoid, algebraic, coverage_message, quadric_columns

__all__ = ["Ellipsoid", "algebraic", "coverage_message", "quadric_columns"]
