"""What a board says about itself before anything is put on it: interpreter, room, ways open to it, modules found."""

import json
from dataclasses import dataclass

from barberpole.errors import PortError, must
from barberpole.link import mpremote

ROM = "/rom/lib"
FROZEN_MARK = ".frozen"  # in sys.path; the emulated board's stand-in for it has it in its name
MODULES = "bp_"

# Frozen modules cannot be listed, so the one that carries their names is imported, with all other places shut.
_PROGRAM = f"""\
import json, os, sys
def names(folder):
    try:
        return [e[0] for e in os.ilistdir(folder or os.getcwd()) if e[0].startswith({MODULES!r})]
    except OSError:
        return []
def mark(folders):
    path = sys.path[:]
    sys.path[:] = folders
    try:
        import bp_build
        return [bp_build.BUILD, list(bp_build.MODULES)]
    except ImportError:
        return None
    finally:
        sys.path[:] = path
        sys.modules.pop('bp_build', None)
def partition():
    try:
        import vfs
        segment = vfs.rom_ioctl(2, 0)
        return 0 if isinstance(segment, int) else len(segment)
    except (ImportError, AttributeError):
        return 0
state = os.statvfs('')
print(json.dumps({{
    'machine': getattr(sys.implementation, '_machine', ''),
    'mpy': getattr(sys.implementation, '_mpy', 0),
    'cwd': os.getcwd(),
    'free': state[0] * state[3],
    'block': state[0],
    'folders': [[f, names(f)] for f in sys.path],
    'frozen': mark([f for f in sys.path if {FROZEN_MARK!r} in f]),
    'romfs': partition(),
}}))
"""


@dataclass(frozen=True)
class BoardState:
    """The answers. `folders`: sys.path in its order, each with the names in it that could be barberpole's."""

    machine: str
    mpy: int
    """sys.implementation._mpy: version of the .mpy format, and the processor from bit 10 on."""
    cwd: str
    """The working folder: /flash on a pyboard, / elsewhere."""
    free: int
    block: int
    folders: tuple[tuple[str, tuple[str, ...]], ...]
    frozen_build: str
    """Hash of the build that is frozen into the firmware; empty where there is none."""
    frozen_modules: tuple[str, ...]
    romfs_bytes: int
    """Size of the ROMFS partition; 0 where the firmware has none."""

    @property
    def mpy_version(self) -> int:
        """Version of .mpy files that the board loads."""
        return self.mpy & 0xFF

    @property
    def processor(self) -> int:
        """Place in mpy.ARCHITECTURES of the native code that the board runs."""
        return self.mpy >> 10 & 0xF

    @property
    def lib(self) -> str:
        """Folder of modules in the file system."""
        return self.cwd.rstrip("/") + "/lib"


def ask(port: str) -> BoardState:
    """Ask the board. Raises PortError where it gives no answer, or another than MicroPython's."""
    text = mpremote.run(port, "exec", _PROGRAM)
    try:
        answer = json.loads(text.strip().splitlines()[-1])
        build, modules = answer["frozen"] or ("", ())
        folders = tuple((folder, tuple(names)) for folder, names in answer["folders"])
        sizes = answer["free"], answer["block"]
        head = answer["machine"], answer["mpy"], answer["cwd"], *sizes
        return BoardState(*head, folders, build, tuple(modules), answer["romfs"])
    except (ValueError, KeyError, TypeError, IndexError):
        raise PortError(must("the board's answer", "of MicroPython", text[-80:] or "nothing", port)) from None
