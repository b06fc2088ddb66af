"""What turns a calibration into firmware: traced, narrowed to the board's floats, printed, packed and weighed."""

from barberpole_codegen.build import BuildResult, build

__version__ = "0.1"
__all__ = ["BuildResult", "build"]
