# bp_array_selfcal.py: one run of currents through the offset coils, which are in series on three wires, calibrates
# every sensor (thesis 6.2). The points of each are kept and then solved one after the other by bp_selfcal. A sensor
# that fails has its own reason and keeps what was in force; the others are calibrated all the same.
import struct
import time

import bp_array_report as report
import bp_board as board
import bp_compensate
import bp_reasons as reasons
import bp_records as records
import bp_selfcal
import bp_store
import bp_trajectory as trajectory
from bp_array import FOLDER
from bp_duty import FAULT, STREAMING

RUN_FILE = FOLDER + "/run.bpr"
_UNREAD = "the converter that reads the currents back gives no samples"


def self_calibrate(station):  # the whole of it, at power-up or when asked for; returns the verdict
    begin_ms = time.ticks_ms()
    station.codes = []
    for member in station.members:
        member.run, member.codes = None, []
    can_sample = _start(station)
    if can_sample and not station.codes:
        _run(station)
    for member in station.members:
        _keep(station, member)
    result = report.verdict(station, time.ticks_diff(time.ticks_ms(), begin_ms) / 1000)
    try:
        bp_store.replace(RUN_FILE, lambda file: report.write_run(file, station.head, station.members, result))
    except OSError:  # the flash is full or worn
        station.event(reasons.STORE_FAILED)
        result["reasons"].append(reasons.STORE_FAILED)
    station.log.flush()
    station.writer.json(records.RESULT, result)
    station.said = (report.again(records.HEADER, station.head), report.again(records.RESULT, result))
    station.state = STREAMING if can_sample else FAULT
    return result


def _start(station):  # the self-test; False where no sensor gives samples
    sampler = station.sampler
    sampler.start(board.ADC_RATIO_CODE, board.ADC_GAIN1, board.ADC_GAIN2)
    try:
        sampler.clear()
        sampler.cycle()
    except reasons.Fault:  # of none: each has its own
        pass
    for member in station.members:
        _check(station, member)
    try:
        station.dac.start(board.DAC_GAIN)
    except reasons.Fault as fault:  # no coils, no self-calibration; but samples can be had
        station.event(fault.code, None, fault.detail)
    first = station.members[0]
    if not first.part.fault and first.compensator.supply_v(first.part) < board.SUPPLY_MIN_V:
        station.event(reasons.SUPPLY_LOW)
    return len(sampler.live) > 0


def _check(station, member):  # whether its samples are alive, and its modules were built together
    part = member.part
    try:
        if part.fault is None:
            part.check()
    except reasons.Fault as fault:
        if fault.code == reasons.SATURATED:
            station.event(fault.code, member)
        else:
            station.sampler.leave_out(part, fault)
    if part.fault:
        station.event(part.fault.code, member, part.fault.detail)
    if member.calibration.BOARD != board.HASH or member.calibration.TRAJECTORY != trajectory.ID:
        station.event(reasons.MODEL_MISMATCH, member)


def _run(station):
    first = station.members[0]
    if first.part.fault:  # nobody reads the currents back
        for member in station.members[1:]:
            if not member.part.fault:
                station.event(reasons.COIL_CURRENT, member, _UNREAD)
        return
    driven = [member for member in station.members if not member.codes]
    for member in driven:
        member.new_run()
    try:
        _measure(station, driven)
    except KeyboardInterrupt:
        report.event(station.writer, station.clock.now_s(), reasons.INTERRUPTED)
        raise
    for member in driven:
        if not member.run.reasons:
            _solve(member)


def _measure(station, driven):  # fills the points; coils at zero on every way out
    coils, first = station.coils, station.members[0]
    try:
        for index in range(trajectory.POINTS):
            codes = struct.unpack_from("<HHH", trajectory.CODES, 6 * index)
            coils.set(codes)
            _average(station.sampler)
            unit = [coils.current_ma(i, codes[i]) / trajectory.UNIT_MA[i] for i in range(3)]
            coil_ma = first.compensator.coil_ma(first.part)
            for member in driven:
                _put(member, unit, coil_ma)
    except reasons.Fault:  # the first converter fails
        for member in driven:
            fault = member.part.fault or reasons.Fault(reasons.COIL_CURRENT, _UNREAD)
            member.run.reasons, member.run.detail = [fault.code], fault.detail
    finally:
        coils.zero()


def _put(member, unit, coil_ma):
    if member.run.reasons:
        return
    try:
        if member.part.fault:
            raise member.part.fault
        member.part.check()
        member.run.points.put(
            unit, bp_compensate.means_lsb(member.part), coil_ma, member.compensator.temp_c(member.part)
        )
    except reasons.Fault as fault:
        member.run.reasons, member.run.detail = [fault.code], fault.detail


def _average(sampler):
    for _ in range(board.SETTLE_CYCLES):
        sampler.cycle()
    sampler.clear()
    for _ in range(board.CYCLES_PER_POINT):
        sampler.cycle()
    if sampler.parts[0].fault:
        raise sampler.parts[0].fault  # nobody reads the currents back


def _solve(member):
    run, calibration = member.run, member.calibration
    try:
        run.solution = bp_selfcal.solve(run.points, calibration, trajectory, calibration.GAIN_DRIFT_LIMIT)
        bp_selfcal.in_numbers(run.solution)
        run.current_ratio = bp_selfcal.current_ratio(run.points, trajectory)
        run.offset_lsb = bp_selfcal.offset_lsb(run.points)
        run.reasons = bp_selfcal.judge(run.solution, run.current_ratio, calibration, board)
    except (ValueError, ZeroDivisionError, OverflowError):  # a root of a negative number, a matrix without rank
        run.reasons = [reasons.OUT_OF_RANGE]


def _keep(station, member):  # what is in force then; gains of 1 where nothing can be compared with today's
    run, calibration = member.run, member.calibration
    for code in member.notes:
        station.event(code, member)
    member.notes = []
    if run is not None:
        for code in run.reasons:
            station.event(code, member, run.detail, **report.figures(run))
    if run is not None and run.accepted:
        solution = run.solution
        gain = solution.gain if calibration.HAS_FACTORY_REFERENCE else (1.0, 1.0, 1.0)
        shift_ut = calibration.in_frame(*solution.ambient_ut) if board.SHIELDED else (0.0, 0.0, 0.0)
        try:
            member.put_in_force(member.store.save(gain, shift_ut, solution.offset_lsb, run.temp_c()))
        except OSError:  # the flash is full or worn
            station.event(reasons.STORE_FAILED, member)
    if not calibration.HAS_FACTORY_REFERENCE:
        station.event(reasons.NO_FACTORY_REFERENCE, member)
