# bp_duty.py: what every station does for the rest of its day: a row a cycle, and commands of a host in between.
# A command is a line of text; the answer is a frame. Here are those that need not know what the station samples.
import gc
import json

from micropython import const

import bp_records as records

STREAMING, STOPPED, FAULT = "streaming", "stopped", "fault"  # FAULT: no samples can be had
_HALF_REPEAT = const(128)  # rows between header and verdict, which are said again for a host that joins later
_IDLE_MS = const(100)


def serve(station, row, commands):  # until Ctrl-C; row() samples one cycle and says it
    station.watchdog.start()
    while True:
        if station.state == STREAMING:
            row()
            line = station.console.command()
        else:
            station.clock.rest()
            line = station.console.command(_IDLE_MS)
        station.watchdog.feed()
        if line is not None:
            obey(station, commands, line)


def count_row(station):
    station.rows += 1
    if station.rows % _HALF_REPEAT == 0:
        station.writer.again(station.said[station.rows // _HALF_REPEAT & 1])


def obey(station, commands, line):
    found = commands.get(line)
    if found is None:
        answer(station, line, False, {"text": "a command must be one of " + ", ".join(sorted(commands))})
        return
    found(station, line)


def answer(station, line, done, fields):
    fields["command"], fields["done"] = line, done
    station.writer.json(records.ANSWER, fields)


def status(station):  # fields of that command which all stations have
    gc.collect()
    fields = {
        "state": station.state,
        "uptime_s": station.clock.now_s(),
        "rows": station.rows,
        "memory_free": gc.mem_free(),
        "watchdog": station.watchdog.runs,
        "log_failed": station.log.failed,
    }
    for name in ("board", "sensor", "firmware", "model", "calibration", "boot"):
        fields[name] = station.head[name]
    return fields


def in_force(held):  # fields that tell which calibration a sensor works with
    return {"in_force": held.where, "in_force_gain": held.gain, "seq": held.seq}


def correction(held, calibration):  # what a self-calibration made, and the build's calibration that it stands on
    return {
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


def stream(station, line):
    if station.state != FAULT:
        station.state = STREAMING
    answer(station, line, station.state == STREAMING, {"state": station.state})


def stop(station, line):
    if station.state == STREAMING:
        station.state = STOPPED
    station.pause()
    station.log.flush()
    answer(station, line, True, {"state": station.state})


def read_log(station, line):  # an answer for each entry, then one that counts them
    station.pause()
    station.log.flush()
    count = 0
    for text in station.log.lines():
        entry = records.content(text)
        if entry is not None:
            station.writer.json(records.ANSWER, {"command": line, "entry": json.loads(entry)})
            count += 1
    answer(station, line, True, {"entries": count, "dropped": station.log.dropped})
