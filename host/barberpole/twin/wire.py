"""The interpreter's requests, decoded and answered (the format stands in shims/_twin.py)."""

import contextlib
import enum
import os
import select
import struct
from collections.abc import Callable

from barberpole.twin.wiring import Wiring

WORD = 8
_HEAD = struct.Struct("<qq")


class Op(enum.IntEnum):
    """What a request asks for."""

    SYNC, SPI, FLASH, STARTED, READY, RESET, BITE = range(7)


class Wire:
    """One end of the two pipes to the interpreter of one start."""

    def __init__(self, soldered: Wiring, on_op: Callable[[Op], None], now_us: int):
        self._soldered = soldered
        self._on_op = on_op
        self.now_us = now_us
        self.interrupt = False
        from_board, to_here = os.pipe()
        from_here, to_board = os.pipe()
        self.far_ends = (to_here, from_here)
        self.fileno = from_board
        self._reply_to = to_board
        for end in self.far_ends:
            os.set_inheritable(end, True)

    def close_far_ends(self) -> None:
        """After the interpreter has been started, which holds its own copies."""
        for end in self.far_ends:
            os.close(end)

    def close(self) -> None:
        """Close this side."""
        os.close(self.fileno)
        os.close(self._reply_to)

    def serve(self, allow: Callable[[int], bool]) -> bool:
        """Answer one request; False when the other side has gone. `allow(t_us)` False: power is cut, no answer."""
        head = os.read(self.fileno, 65536)
        if not head:
            return False
        word, now_us = _HEAD.unpack_from(head)
        changes, sent, wanted = word >> 16 & 0xFFF, word >> 28 & 0xFFFF, word >> 44 & 0xFFFF
        data_at = WORD * (2 + changes)
        data = self._rest(head, data_at + sent)[data_at:] if sent else bytes(wanted)
        if not allow(now_us):
            return True
        if changes:
            for change in memoryview(head)[2 * WORD : data_at].cast("q"):
                self._soldered.pin(change >> 16, change >> 8 & 0xFF, change & 0xFF)
        op = word & 0xFF
        answer = b""
        if op == Op.SPI:
            answer = self._soldered.transfer(now_us, word >> 8 & 0xFF, data)[:wanted]
        elif op != Op.SYNC:
            self._on_op(Op(op))
        self._reply(now_us, answer, may_interrupt=op != Op.FLASH)  # a file system is not left half way
        return True

    def _rest(self, head: bytes, size: int) -> bytes:
        """The bytes sent may come in a second write."""
        while len(head) < size:
            more = os.read(self.fileno, 65536)
            if not more:
                return head.ljust(size, b"\0")
            head += more
        return head

    def asks(self) -> bool:
        """Whether a request waits."""
        poll = select.poll()
        poll.register(self.fileno, select.POLLIN)
        return bool(poll.poll(0))

    def _reply(self, now_us: int, answer: bytes, may_interrupt: bool) -> None:
        self.now_us = now_us + self._soldered.take_charge_us()
        ready_us = self._soldered.ready_at(self.now_us)
        time_us = self.now_us
        if self.interrupt and may_interrupt:
            time_us, self.interrupt = ~self.now_us, False
        with contextlib.suppress(BrokenPipeError):  # killed meanwhile
            os.write(self._reply_to, _HEAD.pack(time_us, ready_us) + answer)
