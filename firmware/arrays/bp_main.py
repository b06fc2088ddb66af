# bp_main.py of an array: power-up with one self-calibration of all sensors, then a row a cycle and commands of a host
# in between, until Ctrl-C: coils at zero, flip pins low, back to the REPL without a word.
import bp_array_report as report
import bp_duty as duty
import bp_reasons as reasons
import bp_records as records
from bp_array import Station
from bp_array_commands import COMMANDS
from bp_array_selfcal import self_calibrate


def run():
    station = Station()
    try:
        station.writer.json(records.HEADER, station.head)
        if station.watchdog.bit:
            station.event(reasons.WATCHDOG)
        self_calibrate(station)
        duty.serve(station, lambda: row(station), COMMANDS)
    except KeyboardInterrupt:
        pass
    finally:
        station.off()
    station.watchdog.let_go()


def row(station):  # samples one cycle and says it
    sampler = station.sampler
    live = sampler.live
    sampler.clear()
    try:
        sampler.cycle()
    except reasons.Fault:  # none is left
        station.state = duty.FAULT
    if sampler.live is not live or any(member.part.clipped for member in station.members):
        _tell(station)
    if station.state == duty.FAULT:
        station.log.flush()
        return
    station.clock.go_to(sampler.mid_us)
    station.writer.frame(records.ROW, report.row(station.members, station.clock.us()))
    duty.count_row(station)


def _tell(station):  # once each, until the next self-calibration
    for member in station.members:
        fault = member.part.fault
        if fault and fault.code not in member.codes:
            station.event(fault.code, member, fault.detail)
        if member.part.clipped and reasons.SATURATED not in member.codes:
            station.event(reasons.SATURATED, member)
