"""Lets every test import the independent truth as `truth`; no deadline for examples, as the machine may be busy."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))
settings.register_profile("busy", deadline=None)
settings.load_profile("busy")
