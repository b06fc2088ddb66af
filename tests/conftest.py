"""Lets every test import the independent truth as `truth`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
