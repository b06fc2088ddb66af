"""A ROMFS image into the board's flash partition, the header last: what is not whole is never mounted.

mpremote's own `romfs deploy` writes from the front and compares nothing; a board that loses power meanwhile would mount
an image that ends in erased flash.
"""

import binascii
from collections.abc import Callable

from barberpole.built import sha256
from barberpole.errors import PortError, must
from barberpole.link import mpremote

CHUNK_BYTES = 4096
WORD_BYTES = 16  # flash is programmed in words; the last chunk is filled up
ERASED = b"\xff"

_HASHES = """\
import binascii, hashlib, vfs
part = vfs.rom_ioctl(2, 0)
for at in range(0, {size}, {chunk}):
    data = part[at:min(at + {chunk}, {size})]
    print(binascii.hexlify(hashlib.sha256(data).digest()).decode())
"""
_BEGIN = """\
import binascii, vfs
try: vfs.umount('/rom')
except OSError: pass
def write(at, text):
    if vfs.rom_ioctl(4, 0, at, binascii.a2b_base64(text)) < 0: raise OSError('the flash cannot be written')
"""
_ERASE = "if vfs.rom_ioctl(3, 0, {size}) < 0: raise OSError('the flash cannot be erased')"
_WRITE = "write({at}, {text!r})"
_END = "vfs.rom_ioctl(5, 0)"


def write_image(port: str, image: bytes, say: Callable[[str], None]) -> int:
    """Bring the partition up to date; returns how many bytes were written (0: it held the image already).

    Chunks that are there are kept, unless one that differs is not erased: flash is only erased as a whole.
    Raises PortError where the board falls silent or the image did not arrive whole; then repeat.
    """
    data = image + bytes(-len(image) % WORD_BYTES)
    chunks = [data[at : at + CHUNK_BYTES] for at in range(0, len(data), CHUNK_BYTES)]
    there = _hashes(port, len(data))
    differ = [k for k, chunk in enumerate(chunks) if there[k] != sha256(chunk)]
    if not differ:
        say("the ROMFS partition holds this image already")
        return 0
    blank = all(there[k] == sha256(ERASED * len(chunks[k])) for k in differ)
    if not blank:
        differ = list(range(len(chunks)))
    say(f"writing {sum(len(chunks[k]) for k in differ)} bytes of ROMFS to {port}")
    steps = [_BEGIN] + ([] if blank else [_ERASE.format(size=len(data))])
    steps += [_write(k, chunks[k]) for k in differ if k] + ([_write(0, chunks[0])] if 0 in differ else [])
    _run(port, [*steps, _END])
    if _hashes(port, len(data)) != [sha256(chunk) for chunk in chunks]:
        raise PortError(must("the ROMFS partition", "what was built", "another content: flash again", port))
    return sum(len(chunks[k]) for k in differ)


def _hashes(port: str, size: int) -> list[str]:
    return mpremote.run(port, "exec", _HASHES.format(size=size, chunk=CHUNK_BYTES)).split()


def _write(number: int, chunk: bytes) -> str:
    return _WRITE.format(at=number * CHUNK_BYTES, text=binascii.b2a_base64(chunk).strip())


def _run(port: str, steps: list[str]) -> None:
    """All in one session, a step after the other."""
    words = [word for step in steps for word in ("+", "exec", step)]
    mpremote.run(port, *words[1:])
