"""The truth that the twin plays must not be the model under test."""

import ast
from pathlib import Path

import barberpole.twin

FORBIDDEN = ("effects", "fit", "fitted", "model", "diagnose", "methods", "calibration", "trajectory")


def test_twin_imports_no_model():
    folder = Path(barberpole.twin.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[:2] not in (["barberpole", part] for part in FORBIDDEN), f"{path.name}: {name}"
