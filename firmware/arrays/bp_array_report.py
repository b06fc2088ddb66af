# bp_array_report.py: header, rows, events and verdict of an array as frames, and the file that keeps its coil run.
# Columns of one sensor begin with its name. A sensor that gives no samples reads nan.
import json
import struct

import bp_board as board
import bp_compensate
import bp_frame
import bp_reasons as reasons
import bp_records as records

VERSION = "0.1.0"
_AXES = "xyz"
_NAN = float("nan")
_READINGS = tuple([axis + state for state in ("_set_lsb", "_reset_lsb") for axis in _AXES]) + ("temp_c",)
_FIELD = ("cx_ut", "cy_ut", "cz_ut")
_CURRENTS = ("ix_ma", "iy_ma", "iz_ma")


def _columns(of_each, of_all):
    names = [sensor + "_" + name for sensor in board.SENSORS for name in of_each]
    return [[name, "f", 1.0] for name in names + list(of_all)]


COLUMNS = [["t_s", "q", 1e-6]] + _columns(_READINGS + _FIELD, _CURRENTS + ("supply_v",))
ROW_FORMAT = "<q" + "f" * (len(COLUMNS) - 1)
RUN_COLUMNS = _columns(_READINGS, _CURRENTS)
RUN_FORMAT = "<" + "f" * len(RUN_COLUMNS)


def header(uid, boot, calibrations):
    return {
        "format": records.FORMAT,
        "role": "array",
        "board": board.BOARD,
        "sensor": board.SENSOR,
        "sensors": board.SENSORS,
        "firmware": VERSION,
        "uid": uid,
        "model": [calibration.MODEL for calibration in calibrations],
        "calibration": [calibration.CALIBRATION for calibration in calibrations],
        "boot": boot,
        "columns": COLUMNS,
        "lsb_per": {"v": board.LSB_PER_V},
    }


def row(members, t_us):  # one cycle, as COLUMNS say; currents and supply are read by the first sensor's converter
    values = []
    for member in members:
        values.extend(_nothing(10) if member.part.fault else _of(member))
    first = members[0]
    if first.part.fault:
        values.extend(_nothing(4))
    else:
        values.extend(first.compensator.coil_ma(first.part))
        values.append(first.compensator.supply_v(first.part))
    return struct.pack(ROW_FORMAT, t_us, *values)


def _of(member):  # six averages, temperature, field; no field where the reading cannot be undone
    means, temp_c = bp_compensate.means_lsb(member.part), member.compensator.temp_c(member.part)
    field = _nothing(3)
    if not member.part.clipped:
        try:
            field = member.compensator.field_ut(means, temp_c)
        except (ValueError, ZeroDivisionError):  # outside the law of the bridge
            pass
    return means + (temp_c,) + tuple(field)


def _nothing(count):
    return (_NAN,) * count


def verdict(station, duration_s):
    sensors = {member.name: _verdict(member) for member in station.members}
    return {
        "accepted": all(found["accepted"] for found in sensors.values()),
        "reasons": station.codes + sorted({code for found in sensors.values() for code in found["reasons"]}),
        "sensors": sensors,
        "shielded": board.SHIELDED,
        "duration_s": duration_s,
    }


def _verdict(member):
    run, held = member.run, member.held
    fields = {
        "accepted": run is not None and run.accepted,
        "reasons": member.codes,
        "in_force": held.where,
        "in_force_gain": held.gain,
        "seq": held.seq,
    }
    if run is not None and run.solution is not None:
        fields.update(figures(run))
        fields["gain_ut_per_unit"] = run.solution.response_ut
        fields["ambient_ut"] = run.solution.ambient_ut
        fields["offset_lsb"] = run.offset_lsb
        fields["temp_c"] = run.temp_c()
    return fields


def figures(run):  # why a self-calibration was refused, in figures; for the log
    if run is None or run.solution is None:
        return {}
    return {
        "current_ratio": run.current_ratio,
        "gain": run.solution.gain,
        "residual_ut": run.solution.residual_ut,
        "ambient_step_ut": run.solution.step_ut,
    }


def again(kind, fields):  # a frame that can be said at any time without an allocation
    return bp_frame.of_json(kind, json.dumps(fields).encode())


def event(writer, t_s, code, detail="", values=None):
    said = dict(values or {})
    if detail:
        said["detail"] = detail
    writer.event(t_s, code, reasons.name(code), reasons.text(code), said)


def write_run(file, head, members, result):  # the coil run, a row each point: what `barberpole pull` fetches
    writer = records.Writer(file.write)
    head = dict(head)
    head["columns"] = RUN_COLUMNS
    writer.json(records.HEADER, head)
    runs = [member.run for member in members]
    count = max([0 if run is None else run.points.count for run in runs])
    for index in range(count):
        values, currents = [], _nothing(3)
        for run in runs:
            if run is None or index >= run.points.count:
                values.extend(_nothing(7))
                continue
            point = run.points.get(index)
            values.extend(point[4:10] + point[13:14])
            currents = point[10:13]
        writer.frame(records.ROW, struct.pack(RUN_FORMAT, *values, *currents))
    writer.json(records.RESULT, result)
