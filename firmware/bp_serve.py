# bp_serve.py: what the board does for the rest of its day: a row a cycle, and commands of a host in between.
# A fault of the hardware ends the stream, not the program: the board goes on to say what is wrong to whoever asks.
from micropython import const

import bp_commands
import bp_reasons as reasons
import bp_records as records
import bp_report as report
from bp_station import FAULT, STREAMING

_HALF_REPEAT = const(128)  # rows between header and verdict, which are said again for a host that joins later
_IDLE_MS = const(100)


def serve(station):  # until Ctrl-C
    station.watchdog.start()
    seen = _Seen(station.hardware.sampler)
    while True:
        if station.state == STREAMING:
            row(station, seen)
            command = station.console.command()
        else:
            station.clock.rest()
            command = station.console.command(_IDLE_MS)
        station.watchdog.feed()
        if command is not None:
            bp_commands.obey(station, command)


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
        station.state = FAULT
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
    station.rows += 1
    if station.rows % _HALF_REPEAT == 0:
        writer.again(station.said[station.rows // _HALF_REPEAT & 1])


def _tell(station, seen):
    sampler = station.hardware.sampler
    if sampler.clipped and not seen.clipped:
        station.event(reasons.SATURATED)
    if sampler.lost != seen.lost:
        station.event(reasons.SAMPLES_LOST, f"{sampler.lost - seen.lost} flip cycles")
    seen.clipped, seen.lost = sampler.clipped, sampler.lost
