# bp_report.py: header, events and verdict of a power-up as fields of JSON frames, and the file that keeps them.
import json
import struct

import bp_board as board
import bp_calibration as calibration
import bp_compensate
import bp_frame
import bp_reasons as reasons
import bp_records as records
import bp_trajectory as trajectory

VERSION = "0.1.0"

# name, struct code, and what one count is worth
COLUMNS = (
    [["t_s", "q", 1e-6]]
    + [[axis + state, "i", 1.0 / board.SAMPLES_PER_HALF] for state in ("_set_lsb", "_reset_lsb") for axis in "xyz"]
    + [[name, "f", 1.0] for name in ("temp_c", "ix_ma", "iy_ma", "iz_ma", "supply_v", "cx_ut", "cy_ut", "cz_ut")]
)
ROW_FORMAT = "<" + "".join([column[1] for column in COLUMNS])
NOT_A_FIELD = (float("nan"),) * 3


def header(uid, boot):
    return {
        "format": records.FORMAT,
        "board": board.BOARD,
        "sensor": board.SENSOR,
        "firmware": VERSION,
        "uid": uid,
        "model": calibration.MODEL,
        "calibration": calibration.CALIBRATION,
        "boot": boot,
        "columns": COLUMNS,
        "lsb_per": {"v": board.LSB_PER_V},
    }


def row(sampler, compensator, t_us):  # one cycle, as COLUMNS say; no field where the reading cannot be undone
    temp_c = compensator.temp_c(sampler)
    sums = [sampler.sums[i] for i in range(6)]
    field = NOT_A_FIELD
    if not sampler.clipped:
        try:
            field = compensator.field_ut(bp_compensate.means_lsb(sampler), temp_c)
        except (ValueError, ZeroDivisionError):  # outside the law of the bridge
            field = NOT_A_FIELD
    currents = compensator.coil_ma(sampler)
    return struct.pack(ROW_FORMAT, t_us, *sums, temp_c, *currents, compensator.supply_v(sampler), *field)


def verdict(codes, held, run):  # run: a bp_selfcal.Run, or None where there was none
    fields = {
        "accepted": run is not None and run.accepted,
        "reasons": codes,
        "in_force": held.where,
        "in_force_gain": held.gain,
        "seq": held.seq,
        "shielded": board.SHIELDED,
    }
    if run is not None:
        fields["duration_s"] = run.duration_s
        fields["current_ratio"] = run.current_ratio
        fields["offset_lsb"] = run.offset_lsb
    if run is not None and run.solution is not None:
        fields["gain"] = run.solution.gain
        fields["gain_ut_per_unit"] = run.solution.response_ut
        fields["ambient_ut"] = run.solution.ambient_ut
        fields["residual_ut"] = run.solution.residual_ut
        fields["ambient_step_ut"] = run.solution.step_ut
        fields["temp_c"] = run.temp_c()
    return fields


def figures(run):  # why a self-calibration was refused, in figures; for the log
    if run is None:
        return {}
    found = {"current_ratio": run.current_ratio, "duration_s": run.duration_s}
    if run.solution is not None:
        found["gain"] = run.solution.gain
        found["residual_ut"] = run.solution.residual_ut
        found["ambient_step_ut"] = run.solution.step_ut
    return found


def again(kind, fields):  # a frame that can be said at any time without an allocation
    return bp_frame.of_json(kind, json.dumps(fields).encode())


def event(writer, t_s, code, detail=""):
    writer.event(t_s, code, reasons.name(code), reasons.text(code), {"detail": detail} if detail else {})


def write_run(file, head, begin_s, run, result, codes):  # the power-up as frames: what `barberpole pull` fetches
    writer = records.Writer(file.write)
    writer.json(records.HEADER, head)
    if run is not None:
        begins = {
            "trajectory": trajectory.ID,
            "points": run.points.count,
            "block": trajectory.BLOCK,
            "unit_ma": trajectory.UNIT_MA,
            "t_s": begin_s,
        }
        writer.json(records.RUN, begins)
        for index in range(run.points.count):
            writer.frame(records.POINT, run.points.packed(index))
    writer.json(records.RESULT, result)
    for code in codes:
        event(writer, begin_s, code, run.detail if run is not None else "")
