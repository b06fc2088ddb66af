# bp_array_commands.py: what a host may ask of an array while it works: a line of text, answered by a frame.
import gc
import json

import bp_array_report as report
import bp_reasons as reasons
import bp_records as records
from bp_array import FAULT, STOPPED, STREAMING
from bp_array_selfcal import self_calibrate


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
    gc.collect()
    codes = station.codes + sorted({code for member in station.members for code in member.codes})
    fields = {
        "state": station.state,
        "reasons": codes,
        "names": [reasons.name(code) for code in codes],
        "sensors": {member.name: _of(member) for member in station.members},
        "uptime_s": station.clock.now_s(),
        "rows": station.rows,
        "memory_free": gc.mem_free(),
        "watchdog": station.watchdog.runs,
        "log_failed": station.log.failed,
    }
    for name in ("board", "sensor", "firmware", "model", "calibration", "boot"):
        fields[name] = station.head[name]
    _answer(station, line, True, fields)


def _of(member):
    held = member.held
    return {
        "state": FAULT if member.part.fault else "sampling",
        "reasons": member.codes,
        "names": [reasons.name(code) for code in member.codes],
        "in_force": held.where,
        "in_force_gain": held.gain,
        "seq": held.seq,
    }


def _selfcal(station, line):
    verdict = self_calibrate(station)
    _answer(station, line, verdict["accepted"], {"state": station.state, "verdict": verdict})


def _stream(station, line):
    if station.state != FAULT:
        station.state = STREAMING
    _answer(station, line, station.state == STREAMING, {"state": station.state})


def _stop(station, line):
    if station.state == STREAMING:
        station.state = STOPPED
    station.log.flush()
    _answer(station, line, True, {"state": station.state})


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
    _answer(station, line, done, {"state": station.state})


def _read_log(station, line):  # an answer for each entry, then one that counts them
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
    "read log": _read_log,
}
