# check_store.py: two slots, the newest valid one wins, and a power cut at any byte leaves one that is whole.
import builtins
import os

import bp_store
from bp_store import FACTORY, Store, next_boot, replace
from fakes import run

FOLDER = "store"
HASH = "0123456789ab"
SHIFT = (0.0, 0.0, 0.0)


def fresh():
    bp_store.make_folder(FOLDER)
    for name in os.listdir(FOLDER):
        os.remove(FOLDER + "/" + name)
    return Store(FOLDER, HASH, (7.0, 8.0, 9.0))


def save(store, gain):
    return store.save((gain, 1.0, 1.0), SHIFT, (1.0, 2.0, 3.0), 25.0)


def check_an_empty_store_gives_the_factory():
    held = fresh().load()
    assert held.where == FACTORY and held.gain == (1.0, 1.0, 1.0) and held.offset_lsb == (7.0, 8.0, 9.0)


def check_slots_take_turns_and_the_newest_wins():
    store = fresh()
    assert [save(store, 1.0 + k / 8).where for k in range(4)] == ["slot a", "slot b", "slot a", "slot b"]
    held = store.load()
    assert held.where == "slot b" and held.seq == 4 and held.gain[0] == 1.375 and held.offset_lsb == (1.0, 2.0, 3.0)


def check_another_calibration_is_not_ours():
    save(fresh(), 1.5)
    other = Store(FOLDER, "ba9876543210", SHIFT)
    assert other.load().where == FACTORY
    assert other.foreign == ("slot a",) and other.corrupt == ()


def check_every_damaged_byte_is_noticed():
    store = fresh()
    save(store, 1.25)
    save(store, 1.5)
    with open(FOLDER + "/b.cal", "rb") as file:
        good = file.read()
    for at in range(len(good)):
        with open(FOLDER + "/b.cal", "wb") as file:
            file.write(good[:at] + bytes((good[at] ^ 1 << at % 8,)) + good[at + 1 :])
        held = store.load()
        assert held.where == "slot a" and held.gain[0] == 1.25
        assert store.corrupt == ("slot b",)


class PowerCut(Exception):
    pass


class CutFile:  # writes so many bytes of all that is asked for, then the power goes
    left = 0

    def __init__(self, path, mode):
        self._file = builtins.open(path, mode)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._file.close()

    def read(self):
        return self._file.read()

    def write(self, data):
        taken = data[: CutFile.left]
        CutFile.left -= len(taken)
        self._file.write(taken)
        if len(taken) < len(data):
            raise PowerCut


def check_a_power_cut_at_any_byte_leaves_a_valid_slot():
    for begin in range(3):  # nothing stored, one slot, two slots
        for bytes_until_cut in range(64):
            store = fresh()
            for k in range(begin):
                save(store, 1.0 + k / 8)
            before = store.load()
            CutFile.left = bytes_until_cut
            bp_store.open = CutFile
            try:
                save(store, 1.5)
                raise AssertionError("there was no power cut")
            except PowerCut:
                pass
            finally:
                del bp_store.open
            after = store.load()
            assert (after.where, after.seq, after.gain) == (before.where, before.seq, before.gain)
            assert save(store, 1.75).seq == before.seq + 1 and store.load().gain[0] == 1.75


def check_boots_are_counted():
    fresh()
    assert [next_boot(FOLDER) for _ in range(3)] == [1, 2, 3]
    with open(FOLDER + "/boot", "wb") as file:
        file.write(b"x")
    assert next_boot(FOLDER) == 1


def check_replace_keeps_the_old_file_until_the_new_one_is_whole():
    fresh()
    path = FOLDER + "/run.bpr"
    replace(path, lambda file: file.write(b"old"))

    def half(file):
        file.write(b"ne")
        raise PowerCut

    try:
        replace(path, half)
    except PowerCut:
        pass
    with open(path, "rb") as file:
        assert file.read() == b"old"
    replace(path, lambda file: file.write(b"new"))
    with open(path, "rb") as file:
        assert file.read() == b"new"


run(globals())
