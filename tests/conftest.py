"""A defined start for tests that interrupt the processes they start."""

import signal

# A shell starts background jobs with Ctrl-C ignored, and every child would inherit that: a run of the tests in the
# background would then wait for interrupts that never arrive. A handler, unlike "ignore", is not inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
