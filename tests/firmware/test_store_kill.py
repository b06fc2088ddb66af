"""The store when the power goes at any write to the flash, or any bit of a slot falls over: it always recovers."""

import json

import pytest

FLASH = """
import gc, json, os, vfs
BLOCK, BLOCKS = 512, 64

class Cut(OSError):
    pass

class Flash:  # in RAM; the power goes at write number `cut`, of which only a part arrives: none, half, all but a byte
    def __init__(self, image=None):
        self.image = bytearray(image) if image else bytearray(b"\\xff" * (BLOCK * BLOCKS))
        self.writes, self.cut, self.part = 0, -1, 0
        self.dead = False  # files that the cut left open are closed by the collector: without power that means nothing
    def readblocks(self, n, into, offset=0):
        if self.dead: return
        at = n * BLOCK + offset
        into[:] = self.image[at : at + len(into)]
    def _power(self):
        self.writes += 1
        return self.cut < 0 or self.writes <= self.cut
    def writeblocks(self, n, data, offset=0):
        if self.dead: return
        at = n * BLOCK + offset
        if self._power():
            self.image[at : at + len(data)] = data
            return
        if self.writes == self.cut + 1:
            size = (0, len(data) // 2, len(data) - 1)[self.part]
            self.image[at : at + size] = data[:size]
        raise Cut(5)
    def ioctl(self, op, arg):
        if self.dead: return 0
        if op == 4: return BLOCKS
        if op == 5: return BLOCK
        if op == 6:  # erase
            if not self._power(): raise Cut(5)
            self.image[arg * BLOCK : arg * BLOCK + BLOCK] = b"\\xff" * BLOCK
        return 0

def mount(flash):
    vfs.umount("/")
    vfs.mount(vfs.VfsLfs2(flash), "/")

flash = Flash()
vfs.VfsLfs2.mkfs(flash)
import bp_store, bp_log, bp_reasons  # while the PC's files are still there
mount(flash)

FACTORY = (5.0, 6.0, 7.0)
def store():
    return bp_store.Store("bp", "0123456789ab", FACTORY)
def save(k):
    return store().save((1.0 + k, 2.0, 3.0), (0.0, 0.0, 0.0), (k, 0.0, 0.0), 25.0)
def held():
    found = store().load()
    return [found.where, found.seq, round(found.gain[0] - 1.0)]

def every_cut(job, look):  # what is found after the power went at each write of `job`, and how many writes it has
    before = bytes(flash.image)
    whole = Flash(before)
    mount(whole)
    job()
    found = []
    for cut in range(3 * whole.writes):
        gc.collect()
        broken = Flash(before)
        mount(broken)
        broken.cut, broken.part = cut // 3, cut % 3
        try:
            job()
        except OSError:
            pass
        broken.dead = True
        mount(Flash(broken.image))
        found.append(look())
    mount(flash)
    return found
"""


def answer(printed):
    """The last line; before it the collector may complain of files that the cut left open."""
    return json.loads(printed.splitlines()[-1])


SAVES = (
    FLASH
    + """
found = []
bp_store.next_boot("bp")
for k in range(1, 4):  # the first save, and one into each slot
    found.append([held(), every_cut(lambda: save(k), held)])
    save(k)
print(json.dumps(found))
"""
)


def test_power_cut_at_every_write_of_a_save(micropython):
    for seq, (before, after) in enumerate(answer(micropython(SAVES))):
        assert before[1] == seq
        assert len(after) >= 6
        for where, found_seq, gain in after:
            assert found_seq in (seq, seq + 1)
            assert gain == found_seq  # never a mixture
            assert where == ("factory" if found_seq == 0 else ("slot a", "slot b")[1 - found_seq % 2])
        assert after[0][1] == seq  # cut at the first write: nothing new


def test_power_cut_at_every_write_of_a_factory_reset(micropython):
    script = FLASH + "save(1); save(2)\nprint(json.dumps([held(), every_cut(lambda: store().clear(), held)]))\n"
    before, after = answer(micropython(script))
    assert before == ["slot b", 2, 2]
    assert {tuple(v) for v in after} <= {("slot b", 2, 2), ("factory", 0, 0)}  # never back to the older slot


RUN_FILE = (
    FLASH
    + """
def keep(text):
    bp_store.replace("bp/run.bpr", lambda file: [file.write(text) for _ in range(40)])
def kept():
    with open("bp/run.bpr") as file:
        data = file.read()
    save(1)  # and the slots can still be written
    return data[:1] if data == 40 * data[:50] else "broken"
bp_store.make_folder("bp")
keep("a" * 50)
print(json.dumps(every_cut(lambda: keep("b" * 50), kept)))
"""
)


def test_power_cut_at_every_write_of_the_run(micropython):
    found = answer(micropython(RUN_FILE))
    assert len(found) > 15
    assert set(found) == {"a", "b"}


LOG = (
    FLASH
    + """
import bp_records
def entries():
    return [json.loads(text)["t_s"] for text in map(bp_records.content, bp_log.Log("bp", 1).lines()) if text]
def write(t_s):
    log = bp_log.Log("bp", 7)
    log.add(t_s, bp_reasons.RESIDUAL, "x" * 100)
    return log.flush()
bp_store.make_folder("bp")
found = []
for t_s in range(40):
    if t_s % 13 == 5:
        found.append([t_s, every_cut(lambda: write(t_s), entries)])
    write(t_s)
sizes = [os.stat("bp/" + name)[6] for name in ("log.a", "log.b")]
print(json.dumps([found, entries(), sizes]))
"""
)


def test_log_is_bounded_and_survives_a_cut_at_every_write(micropython):
    found, kept, sizes = answer(micropython(LOG))
    assert max(sizes) < 4096 + 500
    assert kept == list(range(kept[0], 40))  # the last ones, in order, none missing
    assert len(kept) >= 8
    for t_s, after in found:
        assert len(after) >= 6
        for entries in after:
            assert entries[-1] in (t_s - 1, t_s)
            assert entries == list(range(entries[0], entries[-1] + 1))


BITS = (
    FLASH
    + """
save(1); save(2)
names = {"bp/a.cal": 2, "bp/b.cal": 1}  # what the other slot holds
found = {}
for name in names:
    with open(name, "rb") as file:
        data = bytearray(file.read())
    for bit in range(8 * len(data)):
        data[bit >> 3] ^= 1 << (bit & 7)
        with open(name, "wb") as file:
            file.write(data)
        one = store()
        state = one.load()
        key = json.dumps([name, state.seq, round(state.gain[0] - 1.0), len(one.corrupt), len(one.foreign)])
        found[key] = found.get(key, 0) + 1
        data[bit >> 3] ^= 1 << (bit & 7)
    with open(name, "wb") as file:
        file.write(data)
both = []
for name in names:
    with open(name, "rb") as file:
        data = bytearray(file.read())
    data[20] ^= 1
    with open(name, "wb") as file:
        file.write(data)
both = held()
save(9)
print(json.dumps([found, both, held()]))
"""
)


def test_any_bit_of_either_slot(micropython):
    found, both, again = answer(micropython(BITS))
    assert sum(found.values()) == 2 * 8 * 64
    assert {tuple(json.loads(key)) for key in found} == {("bp/a.cal", 2, 2, 1, 0), ("bp/b.cal", 1, 1, 1, 0)}
    assert both == ["factory", 0, 0]
    assert again == ["slot a", 1, 9]


@pytest.mark.parametrize("text", ["", "x", "$QQ==", "$"])
def test_what_is_no_frame_is_no_content(micropython, text):
    assert micropython(f"import bp_records\nprint(bp_records.content({text.encode()!r}))").strip() == "None"
