# bp_commands.py: what a host may ask a board of one sensor.
import bp_calibration as calibration
import bp_duty as duty
import bp_reasons as reasons
import bp_records as records
import bp_report as report
from bp_station import self_calibrate


def _status(station, line):
    fields = duty.status(station)
    fields.update(duty.in_force(station.held))
    fields["reasons"] = station.codes
    fields["names"] = [reasons.name(code) for code in station.codes]
    fields["lost_cycles"] = station.hardware.sampler.lost
    fields["path"] = "viper" if station.fast is not None and station.fast.ready else "bytecode"
    duty.answer(station, line, True, fields)


def _selfcal(station, line):
    station.pause()
    verdict = self_calibrate(station, [])
    duty.answer(station, line, verdict["accepted"], {"state": station.state, "verdict": verdict})


def _factory_reset(station, line):  # the slots go; the build's calibration is in force
    station.pause()
    try:
        held = station.store.clear()
    except OSError:
        station.event(reasons.STORE_FAILED)
        held = station.store.load()
    station.put_in_force(held)
    station.log.add(station.clock.now_s(), reasons.FACTORY_RESET)
    station.log.flush()
    station.said = (station.said[0], report.again(records.RESULT, report.verdict([reasons.FACTORY_RESET], held, None)))
    duty.answer(station, line, held.seq == 0, {"in_force": held.where, "state": station.state})


def _read_cal(station, line):
    duty.answer(station, line, True, duty.correction(station.held, calibration))


COMMANDS = {
    "status": _status,
    "selfcal now": _selfcal,
    "stream": duty.stream,
    "stop": duty.stop,
    "factory reset": _factory_reset,
    "read cal": _read_cal,
    "read log": duty.read_log,
}
