# bp_station.py: all that the running board knows, and its self-calibration: self-test, coil run, verdict, store.
import binascii
import os
import sys

import machine

import bp_board as board
import bp_calibration as calibration
import bp_reasons as reasons
import bp_records as records
import bp_report as report
import bp_selfcal
import bp_store
import bp_trajectory as trajectory
from bp_clock import Clock
from bp_console import Console
from bp_duty import FAULT, STOPPED, STREAMING
from bp_fast import fast_row
from bp_hardware import Hardware
from bp_log import Log
from bp_watchdog import Watchdog

FOLDER = "bp"  # below the working folder: /flash on a pyboard, / elsewhere
RUN_FILE = FOLDER + "/run.bpr"


class Station:  # all that the running board knows
    def __init__(self):
        self.hardware = Hardware()
        self.writer = records.Writer(sys.stdout.buffer.write)
        self.console = Console()
        self.clock = Clock()
        self.watchdog = Watchdog(board.WATCHDOG_S)
        boot = bp_store.next_boot(FOLDER)
        self.head = report.header(binascii.hexlify(machine.unique_id()).decode(), boot)
        self.log = Log(FOLDER, boot)
        self.store = bp_store.Store(FOLDER, calibration.CALIBRATION, calibration.FACTORY_OFFSET_LSB)
        self.held = self.store.load()
        self.notes = _notes(self.store)  # for the power-up
        self.fast = fast_row(board, calibration, records.ROW, report.ROW_FORMAT)
        self.state = STOPPED
        self.codes = []  # what is wrong, or worth knowing, since the last self-calibration
        self.said = ()  # header and verdict as frames, said again for a host that joins later
        self.rows = 0

    def put_in_force(self, held):
        self.held = held
        self.hardware.compensator.put_in_force(held)
        if self.fast is not None:
            self.fast.put_in_force(self.hardware.compensator)

    def pause(self):  # the flash is written only while nothing is acquired
        self.hardware.sampler.stop()

    def event(self, code, detail="", **values):  # said now, and in the flash at the next pause
        now_s = self.clock.now_s()
        report.event(self.writer, now_s, code, detail)
        if code != reasons.NO_FACTORY_REFERENCE:  # it would come with every power-up
            self.log.add(now_s, code, detail, **values)
        if code not in self.codes:
            self.codes.append(code)


def self_calibrate(station, notes):  # the whole of it, at power-up or when asked for; returns the verdict
    station.codes = list(notes)
    codes, can_sample, detail = self_test(station.hardware)
    begin_s = station.clock.now_s()
    result = None
    held = station.held
    if not codes:
        result = _measure(station)
        codes, detail = result.reasons, result.detail
    station.pause()
    if result is not None and result.accepted:
        held = _save(station.store, held, result, notes)
    station.put_in_force(held)
    if not calibration.HAS_FACTORY_REFERENCE:
        codes = codes + [reasons.NO_FACTORY_REFERENCE]
    verdict = report.verdict(codes, held, result)
    _keep(notes, lambda file: report.write_run(file, station.head, begin_s, result, verdict, notes + codes))
    for code in notes + codes:
        station.event(code, detail, **(report.figures(result) if code in codes else {}))
    station.log.flush()
    station.writer.json(records.RESULT, verdict)
    station.said = (report.again(records.HEADER, station.head), report.again(records.RESULT, verdict))
    station.state = STREAMING if can_sample else FAULT
    return verdict


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


def _measure(station):
    hardware = station.hardware
    try:
        return bp_selfcal.run(hardware.sampler, hardware.coils, hardware.compensator, trajectory, calibration, board)
    except KeyboardInterrupt:
        report.event(station.writer, station.clock.now_s(), reasons.INTERRUPTED)
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
        if reasons.STORE_FAILED not in notes:
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
