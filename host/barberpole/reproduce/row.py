"""One line of the table: what the source prints, what the code computes."""

from dataclasses import dataclass

TOLERANCE = 0.02  # of a published number that follows from published inputs


@dataclass(frozen=True)
class Row:
    """A published value and ours.

    source      "thesis" or "article"
    item        its place: "table 3.2", "fig. 6.7", "eq. B.5"
    quantity    what it is, in words
    published   as printed; None where the source shows a curve and no number
    ours        computed here, in the same unit
    unit        "" for a pure number
    remark      empty, or what the reader must know; where the two differ by more than 2 %: why, with the arithmetic
    """

    source: str
    item: str
    quantity: str
    published: float | None
    ours: float
    unit: str = ""
    remark: str = ""

    @property
    def ratio(self) -> float | None:
        """Ours over published; None where there is nothing to divide by."""
        return self.ours / self.published if self.published else None

    @property
    def met(self) -> bool:
        """Whether ours is the published number within 2 %, or nothing was printed."""
        if self.published is None:
            return True
        return abs(self.ours - self.published) <= TOLERANCE * abs(self.published)
