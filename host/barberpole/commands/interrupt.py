"""Ctrl-C before the first command runs and after the last one has: the program ends without a word then, too.

Loading takes a second; imported first, this module lets the system end the process meanwhile.
"""

import signal
import threading

_ours = (
    threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
)
if _ours:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def loaded() -> None:
    """From now on Ctrl-C is KeyboardInterrupt, which commands clean up after."""
    if _ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def done() -> None:
    """The answer is out: nothing is left to interrupt."""
    if _ours:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
