"""The interpreter's requests, decoded and answered (the format stands in shims/_twin.py).

A request costs two turns between the processes, so the answer to a read of the converter brings along what the next
reads will find: twice as many as the last time where all of those were used, else one more than were.
"""

import contextlib
import enum
import os
import select
import struct
from collections.abc import Callable

from barberpole.twin.frames import NOTHING
from barberpole.twin.wiring import Wiring

WORD = 8
MOST_AHEAD = 15
_HEAD = struct.Struct("<qq")
_ANSWER = struct.Struct("<qqq")
_TIMES = tuple(struct.Struct(f"<{count}q") for count in range(MOST_AHEAD + 3))


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
        self._most_ahead, self._offered = 1, 0
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
        if self._offered:
            self._take(word >> 4 & 0xF)
        if changes:
            for change in memoryview(head)[2 * WORD : data_at].cast("q"):
                self._soldered.pin(change >> 16, change >> 8 & 0xFF, change & 0xFF)
        op = word & 0xF
        answer = b""
        if op == Op.SPI:
            answer = self._soldered.transfer(now_us, word >> 8 & 0xFF, data)[:wanted]
        elif op != Op.SYNC:
            self._on_op(Op(op))
        self._reply(now_us, answer, op)
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

    def _take(self, count: int) -> None:
        """The program has had so many of the frames that were offered, and what the last of them costs."""
        self._soldered.take(count)
        self._soldered.take_charge_us()
        wanted = 2 * self._most_ahead if count == self._offered else max(count + 1, self._most_ahead - 1)
        self._most_ahead, self._offered = min(wanted, MOST_AHEAD), 0

    def _reply(self, now_us: int, answer: bytes, op: int) -> None:
        self.now_us = now_us + self._soldered.take_charge_us()
        ready_us = self._soldered.ready_at(self.now_us)
        time_us = self.now_us
        told = self._soldered.ahead(self._most_ahead) if op == Op.SPI else NOTHING
        self._offered = told.count
        if self.interrupt and op != Op.FLASH:  # a file system is not left half way
            time_us, self.interrupt = ~self.now_us, False
        answer = _ANSWER.pack(time_us, ready_us, told.count | told.charge_us << 4) + answer
        with contextlib.suppress(BrokenPipeError):  # killed meanwhile
            os.write(self._reply_to, answer + _TIMES[len(told.ready_us)].pack(*told.ready_us) + told.frames)
