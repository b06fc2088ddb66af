"""The published figures beside ours: `python -m barberpole.reproduce PAGE` writes them as one table.

A module `thesis_*.py` or `article_*.py` holds published numbers as named constants with their place in the source, and
a function `rows()` that computes ours. `barberpole.reproduce.table.all_rows` lists the modules.
"""

from barberpole.reproduce.row import Row

__all__ = ["Row"]
