"""Which names are those of arrays."""

from pathlib import Path

from barberpole import paths
from barberpole.tables import read_toml


def is_array(name_or_path: str | Path) -> bool:
    """Whether this names an array and no other board. Raises InputError for a file that cannot be read."""
    if not str(name_or_path).endswith(".toml"):
        return (paths.boards() / "arrays" / f"{name_or_path}.toml").is_file()
    return "array" in read_toml(Path(name_or_path), "the board file")
