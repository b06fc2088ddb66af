# bp_commands.py: what a host may ask for while the board works. A command is a line of text; the answer is a frame.
import gc
import json

import bp_calibration as calibration
import bp_reasons as reasons
import bp_records as records
import bp_report as report
from bp_station import FAULT, STOPPED, STREAMING, self_calibrate


def obey(station, line):
    found = _COMMANDS.get(line)
    if found is None:
        _answer(station, line, False, {"text": "a command must be one of " + ", ".join(sorted(_COMMANDS))})
        return
    found(station, line)


def _answer(station, line, done, fields):
    fields["command"], fields["done"] = line, done
    station.writer.json(records.ANSWER, fields)


def _status(station, line):
    sampler, held = station.hardware.sampler, station.held
    gc.collect()
    fields = {
        "state": station.state,
        "reasons": station.codes,
        "names": [reasons.name(code) for code in station.codes],
        "in_force": held.where,
        "in_force_gain": held.gain,
        "seq": held.seq,
        "uptime_s": station.clock.now_s(),
        "rows": station.rows,
        "lost_cycles": sampler.lost,
        "memory_free": gc.mem_free(),
        "path": "viper" if station.fast is not None and station.fast.ready else "bytecode",
        "watchdog": station.watchdog.runs,
        "log_failed": station.log.failed,
    }
    for name in ("board", "sensor", "firmware", "model", "calibration", "boot"):
        fields[name] = station.head[name]
    _answer(station, line, True, fields)


def _selfcal(station, line):
    station.hardware.sampler.stop()
    verdict = self_calibrate(station, [])
    _answer(station, line, verdict["accepted"], {"state": station.state, "verdict": verdict})


def _stream(station, line):
    if station.state != FAULT:
        station.state = STREAMING
    _answer(station, line, station.state == STREAMING, {"state": station.state})


def _stop(station, line):
    if station.state == STREAMING:
        station.state = STOPPED
    station.hardware.sampler.stop()
    station.log.flush()
    _answer(station, line, True, {"state": station.state})


def _factory_reset(station, line):  # the slots go; the build's calibration is in force
    station.hardware.sampler.stop()
    try:
        held = station.store.clear()
    except OSError:
        station.event(reasons.STORE_FAILED)
        held = station.store.load()
    station.put_in_force(held)
    station.log.add(station.clock.now_s(), reasons.FACTORY_RESET)
    station.log.flush()
    station.said = (station.said[0], report.again(records.RESULT, report.verdict([reasons.FACTORY_RESET], held, None)))
    _answer(station, line, held.seq == 0, {"in_force": held.where, "state": station.state})


def _read_cal(station, line):
    held = station.held
    fields = {
        "in_force": held.where,
        "seq": held.seq,
        "gain": held.gain,
        "shift_ut": held.shift_ut,
        "offset_lsb": held.offset_lsb,
        "temp_c": held.temp_c,
        "model": calibration.MODEL,
        "calibration": calibration.CALIBRATION,
        "factory_gain_ut_per_unit": calibration.FACTORY_GAIN_UT_PER_UNIT,
        "gain_drift_limit": calibration.GAIN_DRIFT_LIMIT,
    }
    _answer(station, line, True, fields)


def _read_log(station, line):  # an answer for each entry, then one that counts them
    station.hardware.sampler.stop()
    station.log.flush()
    count = 0
    for text in station.log.lines():
        entry = records.content(text)
        if entry is not None:
            station.writer.json(records.ANSWER, {"command": line, "entry": json.loads(entry)})
            count += 1
    _answer(station, line, True, {"entries": count, "dropped": station.log.dropped})


_COMMANDS = {
    "status": _status,
    "selfcal now": _selfcal,
    "stream": _stream,
    "stop": _stop,
    "factory reset": _factory_reset,
    "read cal": _read_cal,
    "read log": _read_log,
}
