"""What holds for all tests: the same drawn examples in every run, and a defined start for those that interrupt."""

import signal

from hypothesis import settings

# A check that passes here and fails there, by the draw, says nothing about the change at hand.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")

# A shell starts background jobs with Ctrl-C ignored, and every child would inherit that: a run of the tests in the
# background would then wait for interrupts that never arrive. A handler, unlike "ignore", is not inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
