# bp_watchdog.py: restarts a board whose program stands still, in the field and only there.
# Once started it cannot be stopped, and a program at the prompt does not feed it. So it starts only where the board
# file asks for it and the board began by power or by the watchdog itself: whatever a host does (soft reset, the button,
# machine.reset) begins without it. Where a host presses Ctrl-C while it runs, the board says so and restarts without.
import machine


class Watchdog:
    def __init__(self, seconds):
        self._ms = 1000 * seconds
        self.bit = machine.reset_cause() == machine.WDT_RESET  # it is what restarted the board
        self._may = seconds > 0 and machine.reset_cause() in (machine.PWRON_RESET, machine.WDT_RESET)
        self._dog = None

    @property
    def runs(self):
        return self._dog is not None

    def start(self):
        if self._may:
            self._dog = machine.WDT(timeout=self._ms)

    def feed(self):
        if self._dog is not None:
            self._dog.feed()

    def let_go(self):  # a host wants the prompt
        if self._dog is not None:
            print("the watchdog runs: the board restarts without it, connect again")
            machine.reset()
