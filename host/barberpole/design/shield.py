"""Attenuation of shields of high permeability: n coaxial cylinders, spheres (thesis appendix B).

    eps_i = t_i/b_i (1 - t_i/(2 b_i)),   eps_i,i+1 = d_i/(b_i + d_i) (1 - d_i/(2 (b_i + d_i)))                     (B.1)
    u <- (1 - eps_i - eps_i,i+1 + mu eps_i eps_i,i+1) u + eps_i,i+1 v,   v <- mu eps_i u + (1 - eps_i - eps_i,i+1) v
    F = (u + v) / 2,   from u = v = 1                                                                          (B.2-B.4)

for a field across the axis; b_i is the outer radius of shell i, t_i its thickness, d_i the gap to the next. The last
shell has no gap behind it. One shell is exact but for eps / (2 mu); for more of them (B.2) leaves out terms of the
order of eps_i,i+1, so that F comes out too high, by 2.5 % for four layers 10 mm apart around 20 cm.

`exact` matches potentials A r + B r^-p at every surface (p = 1 cylinders, 2 spheres) and leaves out nothing.
Lengths in mm; factors are the field outside over that inside.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

CYLINDER, SPHERE = 1, 2  # power of the field that a surface sends back


@dataclass(frozen=True)
class Shell:
    """One shell: outer radius, thickness, and the gap to the next shell outside it (0 for the last), in mm."""

    outer_mm: float
    thickness_mm: float
    gap_mm: float

    @property
    def inner_mm(self) -> float:
        return self.outer_mm - self.thickness_mm


@dataclass(frozen=True)
class Step:
    """u, v and F = (u + v) / 2 behind one shell, as in table B.1."""

    u: float
    v: float

    @property
    def factor(self) -> float:
        """Eq. B.4."""
        return 0.5 * (self.u + self.v)


def nested(inner_mm: float, thickness_mm: float, gap_mm: float, layers: int) -> tuple[Shell, ...]:
    """Shells around a room of radius `inner_mm`, with equal thickness and gaps."""
    outer = [inner_mm + thickness_mm + k * (thickness_mm + gap_mm) for k in range(layers)]
    return tuple(Shell(b, thickness_mm, gap_mm if k < layers - 1 else 0.0) for k, b in enumerate(outer))


def nested_as_printed(radius_mm: float, thickness_mm: float, gap_mm: float, layers: int) -> tuple[Shell, ...]:
    """The shells that give table B.1: b_i grows by the gap alone, and the last shell too has a gap behind it."""
    return tuple(Shell(radius_mm + k * gap_mm, thickness_mm, gap_mm) for k in range(layers))


def cylinder_steps(shells: Iterable[Shell], permeability: float) -> list[Step]:
    """u and v after each shell, from the inner one outward, eq. B.1-B.3."""
    steps, u, v = [], 1.0, 1.0
    for shell in shells:
        wall = _share(shell.thickness_mm, shell.outer_mm)
        gap = _share(shell.gap_mm, shell.outer_mm + shell.gap_mm)
        loss = 1.0 - wall - gap
        u, v = (loss + permeability * wall * gap) * u + gap * v, permeability * wall * u + loss * v
        steps.append(Step(u, v))
    return steps


def cylinder_factor(shells: Iterable[Shell], permeability: float) -> float:
    """Attenuation of coaxial cylinders in a field across them, eq. B.4."""
    return cylinder_steps(shells, permeability)[-1].factor


def sphere_factor(inner_mm: float, outer_mm: float, permeability: float) -> float:
    """Attenuation of one spherical shell, eq. B.5, which is exact."""
    mu = permeability
    return ((2 * mu + 1) * (mu + 2) - 2 * (inner_mm / outer_mm) ** 3 * (mu - 1) ** 2) / (9 * mu)


def exact_factor(shells: Iterable[Shell], permeability: float, shape: int = CYLINDER) -> float:
    """Attenuation of long cylinders (field across) or of spheres, from the potentials alone.

    Plain arithmetic: given fractions it is exact, where floats lose digits in walls of a millionth of the radius.
    """
    potential = (1, 0)  # A and B of the innermost room
    for shell in shells:
        potential = _cross(potential, shell.inner_mm, 1 / permeability, shape)
        potential = _cross(potential, shell.outer_mm, permeability, shape)
    return potential[0]


def decibel(factor: float) -> float:
    """An attenuation in dB."""
    return 20.0 * math.log10(factor)


def _share(part_mm: float, outer_mm: float) -> float:
    """Part of a ring's cross-section, over twice that of its outer circle: eq. B.1."""
    return part_mm / outer_mm * (1.0 - part_mm / (2.0 * outer_mm))


def _cross(potential: tuple, radius_mm: float, step: float, p: int) -> tuple:
    """(A, B) outside a surface from those inside; `step` is the permeability inside over that outside.

    A r + B r^-p is continuous, and so is mu (A - p B r^-(p+1)).
    """
    a, b = potential
    power = radius_mm ** (p + 1)
    return ((p + step) * a + p * (1 - step) / power * b) / (p + 1), ((1 - step) * power * a + (1 + p * step) * b) / (
        p + 1
    )
