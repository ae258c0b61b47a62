"""Ctrl-C during compiled code ends the process as anywhere else, whatever the code gives back."""

import signal
import subprocess
import sys

PROGRAM = """
import sys
from typing import NamedTuple
import numba
from study.interruption import Interruption

class Pair(NamedTuple):
    first: float
    second: float

@numba.njit
def work(n):
    total = 0.0
    for i in range(n):
        total += 1.0 / (i + 1)
    return total, Pair(total, total)

work(1)
for _ in range(int(sys.argv[1])):
    try:
        with Interruption().watched():
            print("ready", flush=True)
            while True:
                _, pair = work(10**7)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""
#: Where in the code a signal arrives is chance.
ATTEMPTS = 8


def test_a_signal_within_compiled_code_that_returns_named_tuples_is_an_interrupt() -> None:
    command = [sys.executable, "-c", PROGRAM, str(ATTEMPTS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(ATTEMPTS):
            assert process.stdout.readline() == "ready\n"
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "interrupted\n"
    assert process.returncode == 0
