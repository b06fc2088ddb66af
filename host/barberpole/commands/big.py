"""Logs of any length for the commands: read whole where they are short, else piece by piece with a bar on stderr."""

from collections.abc import Sequence
from pathlib import Path

from barberpole.commands.console import ERR, progress
from barberpole.effects import Effect
from barberpole.log import Log, read_log
from barberpole.log_stream import LogStream, is_big, open_stream
from barberpole.modelfile import ModelFile


def read(path: Path, file: ModelFile | None = None, extra: Sequence[Effect] = ()) -> tuple[Log, LogStream | None]:
    """The log and, where it is long, the stream of which the log is then a sample.

    A long log is read whole for effects that need it in one piece, if it is not too long for that.
    """
    if not is_big(path):
        return read_log(path), None
    from barberpole.fit.stream import in_one_piece

    with progress("reading", unit="rows") as tick:
        stream = open_stream(path, tick)
    why = "" if file is None else in_one_piece(stream, file, extra)
    if why:
        ERR.print(f"note: {why} needs the log in one piece: {stream.rows} rows are read into memory", style="dim")
        return read_log(path), None
    return stream.sample, stream
