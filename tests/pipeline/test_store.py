"""A kept result is the computed one: found when nothing changed, computed when anything did, and never half there."""

import errno
import hashlib
import os
import signal
import subprocess
import sys
import textwrap
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import fingerprint
from pipeline import record as record_module
from pipeline.cache_folder import default_folder
from pipeline.record import is_intact
from pipeline.store import Stage, Store, stage

TESTS_TIMEOUT = 60  # s; a hang is an error, a slow machine is none


def counting() -> tuple[Stage[..., Any], list[object]]:
    """Make a stage, and the list of inputs it was computed for."""
    calls: list[object] = []

    def double(value: Any, report: object = None) -> Any:
        calls.append(value)
        return [value, value] if isinstance(value, str | list) else {"twice": np.atleast_1d(np.asarray(value)) * 2}

    return stage("double", ignore=("report",))(double), calls


def entries(folder: Path) -> list[Path]:
    return sorted(folder.glob("objects/*/*.npz"))


def test_the_second_run_is_found_even_by_another_store(tmp_path: Path) -> None:
    double, calls = counting()
    first = Store(tmp_path).outcome(double, 3.5)
    again = Store(tmp_path).outcome(double, 3.5)
    np.testing.assert_array_equal(again.value["twice"], first.value["twice"])
    assert (first.cached, again.cached, calls) == (False, True, [3.5])
    assert again.seconds == first.seconds


@pytest.mark.parametrize("other", [3.5000000000000004, -3.5, np.array([3.5, 3.5]), [3.5], np.float32(3.25), "3.5"])
def test_an_input_that_differs_at_all_is_computed(tmp_path: Path, other: Any) -> None:
    double, calls = counting()
    store = Store(tmp_path)
    store.run(double, 3.5)
    store.run(double, other)
    assert len(calls) == 2


def test_names_defaults_and_ignored_inputs_do_not_matter(tmp_path: Path) -> None:
    double, calls = counting()
    store = Store(tmp_path)
    store.run(double, 2.0)
    store.run(double, value=2.0, report=print)
    assert calls == [2.0]


def test_an_array_is_known_by_its_values_and_not_by_its_layout() -> None:
    rows = np.arange(6.0).reshape(2, 3)
    assert fingerprint.make_canonical(rows) == fingerprint.make_canonical(np.asfortranarray(rows))
    assert fingerprint.make_canonical(rows) != fingerprint.make_canonical(rows.reshape(3, 2))
    assert fingerprint.make_canonical(rows) != fingerprint.make_canonical(rows.astype(np.float32))


def test_a_large_array_is_never_copied_whole() -> None:
    """A reduced model has gigabytes, in Fortran's order; its hash is that of all its bytes."""
    large = np.asfortranarray(np.arange(8_000_000.0).reshape(-1, 8))
    whole = hashlib.sha256(large.tobytes()).hexdigest()
    tracemalloc.start()
    assert fingerprint.make_canonical(large)[-1] == whole
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # A part of 16 MB and its bytes at most.
    assert peak < large.nbytes / 1.5
    for small in (np.zeros(0), np.array(3.0), np.zeros((0, 3)), np.zeros((3, 0)), np.array(["a", "bc"])):
        assert fingerprint.make_canonical(small)[-1] == hashlib.sha256(small.tobytes()).hexdigest()


def test_a_file_is_known_by_its_content(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("same")
    two.write_text("same")
    assert fingerprint.make_canonical(one) == fingerprint.make_canonical(two)
    two.write_text("other")
    assert fingerprint.make_canonical(one) != fingerprint.make_canonical(two)


def test_an_input_whose_content_cannot_be_seen_is_refused() -> None:
    with pytest.raises(TypeError, match="function cannot be the input of a cached stage"):
        fingerprint.make_canonical(lambda: 1)


def truncate(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-1])


def flip(file: Path) -> None:
    raw = bytearray(file.read_bytes())
    raw[len(raw) // 2] ^= 1
    file.write_bytes(bytes(raw))


DAMAGES = [truncate, flip, lambda file: file.write_bytes(b"")]


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_computed_again_and_mended(tmp_path: Path, damage: Callable[[Path], object]) -> None:
    double, calls = counting()
    warnings: list[str] = []
    store = Store(tmp_path, warnings.append)
    store.run(double, 1.0)
    (file,) = entries(tmp_path)
    damage(file)
    np.testing.assert_array_equal(store.run(double, 1.0)["twice"], [2.0])
    assert warnings == [f"a stored result is damaged and will be computed again: double in {file}"]
    assert store.outcome(double, 1.0).cached
    assert len(calls) == 2


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_result_does_not_count_as_stored(tmp_path: Path, damage: Callable[[Path], object]) -> None:
    double, _ = counting()
    warnings: list[str] = []
    store = Store(tmp_path, warnings.append)
    store.run(double, 1.0)
    assert store.has(double, 1.0)
    damage(entries(tmp_path)[0])
    assert not store.has(double, 1.0)
    # Reported once, however often it is asked for.
    assert store.look_up(double, 1.0) is None
    assert len(warnings) == 1


def test_a_result_that_was_removed_is_computed_again_without_a_word(tmp_path: Path) -> None:
    double, calls = counting()
    warnings: list[str] = []
    store = Store(tmp_path, warnings.append)
    store.run(double, 1.0)
    entries(tmp_path)[0].unlink()
    store.run(double, 1.0)
    assert (len(calls), warnings) == (2, [])


def test_a_folder_that_cannot_be_written_is_given_up_with_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    warnings: list[str] = []
    store = Store(tmp_path / "file" / "cache", warnings.append)
    double, calls = counting()
    store.run(double, 1.0)
    store.run(double, 1.0)
    assert len(calls) == 2
    assert len(warnings) == 1
    assert "cannot be written" in warnings[0]


def test_a_disk_that_fails_during_a_write_costs_the_cache_and_not_the_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warnings: list[str] = []
    store = Store(tmp_path, warnings.append)
    double, _ = counting()

    def full_disk(*_: object) -> bytes:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(record_module, "_compute_checksum", full_disk)
    np.testing.assert_array_equal(store.run(double, 21)["twice"], [42])
    assert warnings == [f"the cache {tmp_path} cannot be written (No space left on device): continuing without it"]
    assert not list((tmp_path / "unfinished").iterdir())


def test_a_result_that_cannot_be_stored_is_given_with_one_sentence(tmp_path: Path) -> None:
    warnings: list[str] = []

    def give() -> object:
        return len

    store = Store(tmp_path, warnings.append)
    assert store.run(stage("function")(give)) is len
    (sentence,) = warnings
    assert sentence.startswith("the result of function cannot be stored, and will be computed again: ")


def test_clearing_removes_results_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "diary.txt").write_text("mine")
    store = Store(tmp_path)
    double, calls = counting()
    store.run(double, 1.0)
    assert store.size()[0] == 1
    store.clear()
    assert store.size() == (0, 0)
    assert (tmp_path / "diary.txt").read_text() == "mine"
    store.run(double, 1.0)
    assert len(calls) == 2


def test_the_environment_names_the_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path))
    assert default_folder() == tmp_path


def test_a_stage_that_was_typed_in_is_refused() -> None:
    code = "from pipeline.store import Store, stage; stage('x')(lambda: 1).key()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "a stage must be defined in a file" in done.stderr


def test_a_stage_that_ignores_what_it_does_not_take_is_refused() -> None:
    double, _ = counting()
    with pytest.raises(TypeError, match=r"stage 'x' ignores \['reprot'\]"):
        stage("x", ignore=("reprot",))(double.compute)


# A room of its own, edited between two runs.
DUMMY = '''
"""A room."""

def factor():
    """Twice."""
    return 2.0  # a comment
'''
RUN_DUMMY = """
import sys
from pathlib import Path
from pipeline.store import Store, stage
def compute():
    from dummy_room.sub import formula
    return formula.factor()
print(Store(Path(sys.argv[1])).outcome(stage("dummy")(compute)))
"""


@pytest.mark.parametrize(
    ("old", "new", "is_found"),
    [
        ("# a comment", "# another one", True),
        ('"""Twice."""', '"""Doubled,\n    as ever."""', True),
        ('"""A room."""\n\n', '"""A room with\nmore words."""\n\n\n\n', True),
        ("return 2.0", "return (2.0)", True),
        ("return 2.0", "return 3.0", False),
        ("return 2.0", "return 2.0 * 1.0", False),
    ],
)
def test_an_edited_comment_recomputes_nothing_and_an_edited_formula_does(
    tmp_path: Path, old: str, new: str, is_found: bool
) -> None:
    formula = tmp_path / "dummy_room" / "sub" / "formula.py"
    formula.parent.mkdir(parents=True)
    for folder in (formula.parent, formula.parent.parent):
        (folder / "__init__.py").write_text("")

    (tmp_path / "run.py").write_text(RUN_DUMMY)

    def run(text: str) -> str:
        formula.write_text(text)
        return subprocess.run(
            [sys.executable, "-B", str(tmp_path / "run.py"), str(tmp_path / "cache")],
            capture_output=True, text=True, check=True, timeout=TESTS_TIMEOUT,
        ).stdout  # fmt: skip

    assert old in DUMMY
    assert "cached=False" in run(DUMMY)
    assert f"cached={is_found}" in run(DUMMY.replace(old, new))


# Writes one entry after another; each holds its own number many times, so that a torn one would show.
WRITER = """
import sys
from pathlib import Path
import numpy as np
from pipeline.store import Store, stage
@stage("numbers")
def numbers(i: int):
    return {"i": i, "data": np.full(200_000, float(i))}
store = Store(Path(sys.argv[1]))
print("ready", flush=True)
for i in range(int(sys.argv[2])):
    value = store.run(numbers, i)
    assert value["i"] == i and np.all(value["data"] == i)
print("finished", flush=True)
"""


def writer(folder: Path, count: int) -> "subprocess.Popen[str]":
    script = folder.with_suffix(".py")
    script.write_text(WRITER)
    return subprocess.Popen(
        [sys.executable, str(script), str(folder), str(count)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def all_intact(folder: Path) -> int:
    """Count entries after checking each against its checksum."""
    assert all(map(is_intact, entries(folder)))
    return len(entries(folder))


def test_a_process_killed_at_any_moment_leaves_whole_entries_and_the_next_one_goes_on(tmp_path: Path) -> None:
    count = 0
    for pause in (0.02, 0.05, 0.09):
        process = writer(tmp_path, 10_000)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(pause)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=TESTS_TIMEOUT)
        assert process.returncode == -signal.SIGKILL
        assert all_intact(tmp_path) >= count
        count = all_intact(tmp_path)
    finished = writer(tmp_path, 3)
    assert "finished" in finished.communicate(timeout=TESTS_TIMEOUT)[0]


def test_an_entry_that_was_being_written_when_the_process_died_is_not_an_entry(tmp_path: Path) -> None:
    # It kills its own process when all but the checksum is written: the worst moment, hit with certainty.
    script = textwrap.dedent("""
        import os, signal, sys
        from pathlib import Path
        from pipeline import record
        from pipeline.store import Store, stage
        def kill(*_):
            os.kill(os.getpid(), signal.SIGKILL)
        record._compute_checksum = kill
        @stage("deadly")
        def deadly():
            return 1
        Store(Path(sys.argv[1])).run(deadly)
    """)
    (tmp_path / "deadly.py").write_text(script)
    command = [sys.executable, str(tmp_path / "deadly.py"), str(tmp_path)]
    done = subprocess.run(command, check=False, timeout=TESTS_TIMEOUT)
    assert done.returncode == -signal.SIGKILL
    assert entries(tmp_path) == []
    leftover = list((tmp_path / "unfinished").iterdir())
    assert len(leftover) == 1
    # Two days later it is swept away; today it might still be at work.
    Store(tmp_path)
    assert leftover[0].exists()
    long_ago = time.time() - 2 * 86400
    os.utime(leftover[0], (long_ago, long_ago))
    Store(tmp_path)
    assert not leftover[0].exists()


def test_two_processes_may_compute_the_same_at_once(tmp_path: Path) -> None:
    processes = [writer(tmp_path, 40) for _ in range(2)]
    for process in processes:
        output, errors = process.communicate(timeout=TESTS_TIMEOUT)
        assert "finished" in output, errors
    assert all_intact(tmp_path) == 40
    assert not list((tmp_path / "unfinished").iterdir())


def test_arrays_read_back_are_the_ones_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    arrays: list[NDArray[Any]] = [
        rng.standard_normal((3, 4)), rng.standard_normal((2, 2)) * 1j, np.arange(5), np.zeros((0, 3)),
        np.array([True, False]), np.array(["hex8", "é"]), np.array(3.5), np.asfortranarray(rng.standard_normal((3, 2))),
    ]  # fmt: skip

    def give() -> list[NDArray[Any]]:
        return arrays

    kept = stage("arrays")(give)
    Store(tmp_path).run(kept)
    outcome = Store(tmp_path).outcome(kept)
    assert outcome.cached
    for back, array in zip(outcome.value, arrays, strict=True):
        assert back.dtype == array.dtype
        np.testing.assert_array_equal(back, array)


def test_a_disk_that_fails_for_a_moment_costs_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    double, calls = counting()
    store = Store(tmp_path, lambda _: None)
    store.run(double, 1.0)
    with monkeypatch.context() as failing:
        failing.setattr(record_module, "_compute_checksum", too_many_files)
        assert not store.has(double, 1.0)
    assert store.outcome(double, 1.0).cached
    assert len(calls) == 1


def too_many_files(*_: object) -> bytes:
    raise OSError(errno.EMFILE, "too many open files")
