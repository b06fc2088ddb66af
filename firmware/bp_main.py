# bp_main.py: power-up, then whatever bp_serve does until Ctrl-C, which ends it at any time: coils at zero, flip pins
# low, back to the REPL without a word.
import bp_reasons as reasons
import bp_records as records
import bp_serve
from bp_station import Station, self_calibrate


def run():
    station = Station()
    try:
        station.writer.json(records.HEADER, station.head)
        if station.watchdog.bit:
            station.event(reasons.WATCHDOG)
        self_calibrate(station, station.notes)
        bp_serve.serve(station)
    except KeyboardInterrupt:
        pass
    finally:
        station.hardware.off()
    station.watchdog.let_go()
