"""Where a model fails, which effect it lacks, and which measurement would tell."""

from barberpole.diagnose.answer import Diagnosis, Suspect
from barberpole.diagnose.compare import Comparison, compare
from barberpole.diagnose.diagnosis import diagnose, diagnose_observations
from barberpole.diagnose.patterns import Pattern

__all__ = ["Comparison", "Diagnosis", "Pattern", "Suspect", "compare", "diagnose", "diagnose_observations"]
