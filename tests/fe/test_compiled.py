"""Compiled code is stored; what a power cut or a full disk does to it is mended, and waiting for it is announced."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.slow import slow

#: A small function of a package whose compilation is announced, in a process of its own: what is loaded stays loaded.
SCRIPT = """
import sys
sys.path.insert(0, {folder!r})
import kernel
from fe.compiled import compiled, DURATION
DURATION["kernel"] = "about a second"
machine = compiled(kernel.twice)
assert machine(2.0) == 4.0
print(sum(machine.stats.cache_hits.values()))
"""


class Runner:
    """Runs a script with a store of compiled code of its own."""

    def __init__(self, folder: Path) -> None:
        self.store = folder / "store"
        (folder / "kernel.py").write_text("def twice(x):\n    return 2 * x\n")
        self.script = SCRIPT.format(folder=str(folder))

    def __call__(self, **environment: str) -> tuple[str, str]:
        done = subprocess.run(
            [sys.executable, "-c", self.script],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            env={**os.environ, "NUMBA_CACHE_DIR": str(self.store), **environment},
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip(), done.stderr

    def files(self, suffix: str) -> list[Path]:
        result = list(self.store.rglob(f"*.{suffix}"))
        assert result
        return result


@pytest.fixture
def run(tmp_path: Path) -> Runner:
    return Runner(tmp_path)


def test_a_compilation_is_announced_once_and_where_it_is_stored(run: Runner) -> None:
    hits, said = run()
    assert (hits, said.count("\n")) == ("0", 1)
    assert "about a second" in said
    assert str(run.store) in said
    assert run() == ("1", "")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Runner:
    """Its code is stored, and whole again after each test."""
    run = Runner(tmp_path_factory.mktemp("stored"))
    run()
    return run


@pytest.mark.parametrize(
    ("suffix", "left"),
    [("nbi", 0.0), ("nbc", 0.5), pytest.param("nbi", 0.5, marks=slow), pytest.param("nbc", 0.0, marks=slow)],
)
def test_a_file_that_a_power_cut_left_is_compiled_again(stored: Runner, suffix: str, left: float) -> None:
    for file in stored.files(suffix):
        file.write_bytes(file.read_bytes()[: int(left * file.stat().st_size)])
    hits, said = stored()
    assert hits == "0"
    assert "damaged" in said
    assert str(stored.store) in said
    assert stored() == ("1", "")


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("share", [0.6, *(pytest.param(share, marks=slow) for share in (0.0, 0.3, 0.999))])
def test_a_file_with_a_changed_bit_is_compiled_again(stored: Runner, suffix: str, share: float) -> None:
    (file,) = stored.files(suffix)
    content = bytearray(file.read_bytes())
    content[int(share * len(content))] ^= 0x10
    file.write_bytes(content)
    hits, said = stored()
    assert hits == "0"
    assert "damaged" in said
    assert stored() == ("1", "")


def test_where_no_folder_can_be_written_the_remedy_is_named_and_nothing_stays(run: Runner, tmp_path: Path) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    run.store.write_text("a file where a folder should be")
    hits, said = run(TMPDIR=str(temporary))
    assert hits == "0"
    assert "every run" in said
    assert "NUMBA_CACHE_DIR" in said
    assert list(temporary.iterdir()) == []


FULL = """
import numba.core.caching

def full(*_):
    raise OSError(28, "No space left on device")

numba.core.caching.IndexDataCacheFile.save = full
"""


def test_on_a_full_disk_the_code_runs_and_the_folder_is_named(run: Runner) -> None:
    run.script = FULL + run.script
    hits, said = run()
    assert hits == "0"
    for words in ("No space left on device", str(run.store), "NUMBA_CACHE_DIR"):
        assert words in said


def test_the_rooms_that_announce_are_there() -> None:
    from fe.compiled import DURATION

    assert all(importlib.util.find_spec(package) for package in DURATION)


NAMES = """
import llvmlite.binding as llvm
named, add = [], llvm.add_symbol
llvm.add_symbol = lambda name, address: (named.append(name), add(name, address))
from fe.compiled import name_symbols
from numba.core.registry import cpu_target
name_symbols()
assert {"NRT_Allocate", "_numba_hashsecret_siphash_k0"} <= set(named)
named.clear()
cpu_target.target_context.refresh()
print(*named)
"""


def test_the_linker_knows_all_that_numba_would_name(run: Runner) -> None:
    # Machine code that calls what has no name there ends the process.
    run.script = NAMES
    assert run() == ("", "")


CALLER = """
import numba
(library,) = [overload.library for overload in machine.overloads.values()]
unread = library._unread is not None
caller = numba.njit(lambda x: machine(x) + 1.0)
print(unread, caller(2.0), library._unread is not None)
"""


def test_what_stored_code_was_made_from_is_read_when_another_function_is_compiled_with_it(run: Runner) -> None:
    run.script += CALLER
    hits, _ = run()
    assert hits == "0\nFalse 5.0 False"
    assert run() == ("1\nTrue 5.0 False", "")
