"""Memory between objects that live on is given back to the system."""

import subprocess
import sys
from pathlib import Path

import pytest

#: Blocks of 64 KiB, which the C library takes from its heap, with small objects that live on between them.
SCRIPT = """
from pathlib import Path
from pipeline.freed_memory import return_freed_memory
def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096
before = resident()
large, small = [], []
for number in range(4000):
    large.append(bytearray(2**16))
    small.append(bytearray(1000))
del large
freed = resident() - before
return_freed_memory()
print(freed, resident() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not tell the memory of a process")
def test_memory_between_small_objects_goes_back() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    kept, left = map(int, done.stdout.split())
    assert kept > 100e6  # without it, most of 262 MB stay
    assert left < 30e6  # 4 MB are in use, and each small object keeps a page of 4 kB
