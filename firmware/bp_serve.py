# bp_serve.py: rows of a board of one sensor, one a cycle, for the rest of its day.
# A fault of the hardware ends the stream, not the program: the board goes on to say what is wrong to whoever asks.
import bp_duty as duty
import bp_reasons as reasons
import bp_records as records
import bp_report as report
from bp_commands import COMMANDS


def serve(station):  # until Ctrl-C
    seen = _Seen(station.hardware.sampler)
    duty.serve(station, lambda: row(station, seen), COMMANDS)


class _Seen:  # of what is told once and not with every row
    def __init__(self, sampler):
        self.clipped = 0
        self.lost = sampler.lost


def row(station, seen):  # samples one cycle and says it
    sampler, writer, clock = station.hardware.sampler, station.writer, station.clock
    sampler.clear()
    try:
        sampler.cycle()
    except reasons.Fault as fault:
        station.state = duty.FAULT
        station.event(fault.code, fault.detail)
        sampler.stop()
        station.log.flush()
        return
    if sampler.clipped != seen.clipped or sampler.lost != seen.lost:
        _tell(station, seen)
    clock.go_to(sampler.mid_us)
    fast = station.fast
    if sampler.clipped or fast is None or not fast.ready or not writer.row(fast, sampler.sums, clock.limbs):
        writer.frame(records.ROW, report.row(sampler, station.hardware.compensator, clock.us()))
    duty.count_row(station)


def _tell(station, seen):
    sampler = station.hardware.sampler
    if sampler.clipped and not seen.clipped:
        station.event(reasons.SATURATED)
    if sampler.lost != seen.lost:
        station.event(reasons.SAMPLES_LOST, f"{sampler.lost - seen.lost} flip cycles")
    seen.clipped, seen.lost = sampler.clipped, sampler.lost
