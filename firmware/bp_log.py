# bp_log.py: what went wrong, kept over power cycles: frames of records, in two files that take turns.
# Entries wait in memory until flush(), which is called only while nothing is acquired: a write to the flash locks out
# interrupts for up to 170 ms. When a file is full the other one is begun anew, so that the last 4 to 8 KiB are kept,
# and a sector of the flash is erased once in some twenty entries.
import os

from micropython import const

import bp_reasons as reasons
import bp_records as records
import bp_store

_NAMES = ("log.a", "log.b")
_FULL = const(4096)  # bytes
_WAITING = const(16)  # entries; what comes on top is counted, not kept


class Log:
    def __init__(self, folder, boot):
        self._paths = tuple(folder + "/" + name for name in _NAMES)
        self._boot = boot
        self._entries = []
        self.dropped = 0
        self.failed = False  # the flash did not take the last entries

    def add(self, t_s, code, detail="", **values):
        if len(self._entries) >= _WAITING:
            self.dropped += 1
            return
        fields = {"boot": self._boot, "t_s": t_s, "code": code, "name": reasons.name(code), "text": reasons.text(code)}
        if detail:
            fields["detail"] = detail
        fields.update(values)
        self._entries.append(fields)

    def flush(self):  # True if the flash took them; what it did not take is gone
        entries, self._entries = self._entries, []
        if not entries:
            return True
        try:
            self._append(entries)
            self.failed = False
        except OSError:
            self.failed = True
        return not self.failed

    def lines(self):  # all that is kept, oldest first
        current = self._current()
        for path in (self._paths[1 - current], self._paths[current]):
            try:
                with open(path, "rb") as file:
                    for line in file:
                        if len(line) > 1:
                            yield line
            except OSError:
                pass  # it was never begun

    def _append(self, entries):
        current = self._current()
        with open(self._paths[current], "ab") as file:
            file.write(b"\n")  # the line before may have been cut short
            writer = records.Writer(file.write)
            for fields in entries:
                writer.json(records.EVENT, fields)
        if _size(self._paths[current]) >= _FULL:
            with open(self._paths[1 - current], "wb"):
                pass
        bp_store.sync()

    def _current(self):  # the one that is not full; the other is full, or was never begun
        return 1 if _size(self._paths[0]) >= _FULL else 0


def _size(path):
    try:
        return os.stat(path)[6]
    except OSError:
        return 0
