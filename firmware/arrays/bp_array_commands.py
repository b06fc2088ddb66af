# bp_array_commands.py: what a host may ask an array; answers go by sensor.
import bp_array_report as report
import bp_duty as duty
import bp_reasons as reasons
import bp_records as records
from bp_array_selfcal import self_calibrate


def _status(station, line):
    fields = duty.status(station)
    codes = station.codes + sorted({code for member in station.members for code in member.codes})
    fields["reasons"] = codes
    fields["names"] = [reasons.name(code) for code in codes]
    fields["sensors"] = {member.name: _of(member) for member in station.members}
    duty.answer(station, line, True, fields)


def _of(member):
    fields = duty.in_force(member.held)
    fields["state"] = duty.FAULT if member.part.fault else "sampling"
    fields["reasons"] = member.codes
    fields["names"] = [reasons.name(code) for code in member.codes]
    return fields


def _selfcal(station, line):
    verdict = self_calibrate(station)
    duty.answer(station, line, verdict["accepted"], {"state": station.state, "verdict": verdict})


def _factory_reset(station, line):  # the slots of all sensors go; the build's calibrations are in force
    for member in station.members:
        try:
            held = member.store.clear()
        except OSError:
            station.event(reasons.STORE_FAILED, member)
            held = member.store.load()
        member.put_in_force(held)
        member.run, member.codes = None, [reasons.FACTORY_RESET]
    station.log.add(station.clock.now_s(), reasons.FACTORY_RESET)
    station.log.flush()
    station.said = (station.said[0], report.again(records.RESULT, report.verdict(station, 0.0)))
    done = all(member.held.seq == 0 for member in station.members)
    duty.answer(station, line, done, {"state": station.state})


def _read_cal(station, line):
    fields = {member.name: duty.correction(member.held, member.calibration) for member in station.members}
    duty.answer(station, line, True, {"sensors": fields})


COMMANDS = {
    "status": _status,
    "selfcal now": _selfcal,
    "stream": duty.stream,
    "stop": duty.stop,
    "factory reset": _factory_reset,
    "read cal": _read_cal,
    "read log": duty.read_log,
}
