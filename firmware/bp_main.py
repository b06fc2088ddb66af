# bp_main.py: power-up. Self-test, load what was in force, self-calibrate, judge, store, then stream.
# Ctrl-C ends it at any time: coils at zero, flip pins low, back to the REPL without a word.
import binascii
import os
import sys
import time

import machine
from micropython import const

import bp_board as board
import bp_calibration as calibration
import bp_reasons as reasons
import bp_records as records
import bp_report as report
import bp_selfcal
import bp_store
import bp_trajectory as trajectory
from bp_hardware import Hardware

FOLDER = "bp"  # below the working folder: /flash on a pyboard, / elsewhere
RUN_FILE = FOLDER + "/run.bpr"
_HALF_REPEAT = const(128)  # rows between header and verdict, which are said again for a host that joins later


class Clock:  # microseconds since it was made, from ticks that wrap
    def __init__(self):
        self._ticks = time.ticks_us()
        self._us = 0

    def at_us(self, ticks):
        self._us += time.ticks_diff(ticks, self._ticks)
        self._ticks = ticks
        return self._us

    def now_s(self):
        return self.at_us(time.ticks_us()) / 1000000


def run():
    hardware = Hardware()
    writer = records.Writer(sys.stdout.buffer.write)
    clock = Clock()
    try:
        said = power_up(hardware, writer, clock)
        if said is not None:
            stream(hardware, writer, clock, said)
    except KeyboardInterrupt:
        return
    finally:
        hardware.off()


def power_up(hardware, writer, clock):  # what was said of it, header and verdict; None where no samples can be had
    head = report.header(binascii.hexlify(machine.unique_id()).decode(), bp_store.next_boot(FOLDER))
    writer.json(records.HEADER, head)
    store = bp_store.Store(FOLDER, calibration.CALIBRATION, calibration.FACTORY_OFFSET_LSB)
    held = store.load()
    notes = _notes(store)
    codes, can_sample, detail = self_test(hardware)
    begin_s = clock.now_s()
    result = None
    if not codes:
        result = _self_calibrate(hardware, writer, clock)
        codes, detail = result.reasons, result.detail
        if result.solution is not None and not codes:
            held = _save(store, held, result, notes)
    hardware.compensator.put_in_force(held)
    if not calibration.HAS_FACTORY_REFERENCE:
        codes = codes + [reasons.NO_FACTORY_REFERENCE]
    verdict = report.verdict(codes, held, result)
    _keep(notes, lambda file: report.write_run(file, head, begin_s, result, verdict, notes + codes))
    for code in notes + codes:
        report.event(writer, begin_s, code, detail)
    writer.json(records.RESULT, verdict)
    return ((records.HEADER, head), (records.RESULT, verdict)) if can_sample else None


def self_test(hardware):  # codes of what forbids a self-calibration, whether samples can be had, and a detail
    try:
        hardware.start()
        hardware.sampler.clear()
        hardware.sampler.cycle()
        hardware.sampler.check()
    except reasons.Fault as fault:
        return [fault.code], fault.code == reasons.SATURATED, fault.detail
    try:
        hardware.dac.start(board.DAC_GAIN)
    except reasons.Fault as fault:  # no coils, no self-calibration; but samples can be had
        return [fault.code], True, fault.detail
    found = []
    if hardware.compensator.supply_v(hardware.sampler) < board.SUPPLY_MIN_V:
        found.append(reasons.SUPPLY_LOW)
    if calibration.BOARD != board.HASH or calibration.TRAJECTORY != trajectory.ID:
        found.append(reasons.MODEL_MISMATCH)
    return found, True, ""


def stream(hardware, writer, clock, said):  # a row a cycle until Ctrl-C, or until the converter falls silent
    sampler = hardware.sampler
    clipped = rows = lost = 0
    while True:
        sampler.clear()
        try:
            sampler.cycle()
        except reasons.Fault as fault:
            report.event(writer, clock.now_s(), fault.code, fault.detail)
            return
        if sampler.clipped and not clipped:
            report.event(writer, clock.now_s(), reasons.SATURATED)
        clipped = sampler.clipped
        if sampler.lost != lost:
            report.event(writer, clock.now_s(), reasons.SAMPLES_LOST, f"{sampler.lost - lost} flip cycles")
            lost = sampler.lost
        writer.frame(records.ROW, report.row(sampler, hardware.compensator, clock.at_us(sampler.mid_us)))
        rows += 1
        if rows % _HALF_REPEAT == 0:  # its check sum takes longer than a cycle: a row or two is left out
            kind, fields = said[rows // _HALF_REPEAT % 2]
            writer.json(kind, fields)


def _self_calibrate(hardware, writer, clock):
    try:
        return bp_selfcal.run(hardware.sampler, hardware.coils, hardware.compensator, trajectory, calibration, board)
    except KeyboardInterrupt:
        report.event(writer, clock.now_s(), reasons.INTERRUPTED)
        raise


def _save(store, held, result, notes):  # what is in force then; gains of 1 where nothing can be compared with today's
    solution = result.solution
    gain = solution.gain if calibration.HAS_FACTORY_REFERENCE else (1.0, 1.0, 1.0)
    shift_ut = calibration.in_frame(*solution.ambient_ut) if board.SHIELDED else (0.0, 0.0, 0.0)
    try:
        return store.save(gain, shift_ut, solution.offset_lsb, result.temp_c())
    except OSError:  # the flash is full or worn
        notes.append(reasons.STORE_FAILED)
        return held


def _keep(notes, produce):
    try:
        bp_store.replace(RUN_FILE, produce)
    except OSError:
        notes.append(reasons.STORE_FAILED)


def _notes(store):  # codes of what is worth knowing and forbids nothing
    found = []
    if store.corrupt:
        found.append(reasons.STORE_CORRUPT)
    if any(name.startswith("bp_") for name in os.listdir()) or _text_beside_compiled("lib"):
        found.append(reasons.SHADOWED)
    return found


def _text_beside_compiled(folder):  # MicroPython takes the text
    try:
        names = os.listdir(folder)
    except OSError:  # no such folder: the firmware is frozen or in ROMFS
        return False
    return any(name.startswith("bp_") and name.endswith(".mpy") and name[:-4] + ".py" in names for name in names)
