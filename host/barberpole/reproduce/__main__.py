"""`python -m barberpole.reproduce PAGE` writes the table of published and reproduced figures."""

import sys
from pathlib import Path

from barberpole.reproduce.table import write_page

if __name__ == "__main__":
    write_page(Path(sys.argv[1]))
