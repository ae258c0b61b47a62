"""A record is read back as it was written, or noticed as damaged, whatever happens to its file."""

import os
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.record import DamagedRecord, Record, is_intact, read_record, write_record

VALUE = {"points": np.arange(12.0).reshape(3, 4), "step": 0.1, "names": ("a", "é")}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    write_record(tmp_path / "one.npz", Record(value=VALUE, name="curve", key="abc", seconds=1.5))
    return tmp_path / "one.npz"


def test_a_record_has_its_name_key_and_cost(file: Path) -> None:
    record = read_record(file)
    assert record is not None
    assert (record.name, record.key, record.seconds) == ("curve", "abc", 1.5)
    assert record.value["names"] == VALUE["names"]
    np.testing.assert_array_equal(record.value["points"], VALUE["points"])
    assert [item.name for item in file.parent.iterdir()] == ["one.npz"]


def test_numpy_and_any_zip_program_read_it(file: Path) -> None:
    with np.load(file, allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["0"], VALUE["points"])
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["0.npy", "tree.json", "places.json", "header.json"]


def test_many_small_arrays_are_one_in_the_file(tmp_path: Path) -> None:
    numbers = [np.full((2, size), complex(size, 1)) for size in range(5)]
    value = {
        "motion": numbers, "again": numbers[3], "one": np.array(7.0), "turned": np.arange(6.0).reshape(2, 3).T,
        "words": [np.array(["a"]), np.array(["bc"])], "large": np.arange(4096.0), "true": np.array([True, False]),
    }  # fmt: skip
    write_record(tmp_path / "one.npz", Record(value=value))
    with zipfile.ZipFile(tmp_path / "one.npz") as archive:
        assert [name for name in archive.namelist() if "pooled" in name] == ["pooled_<c16.npy"]
    record = read_record(tmp_path / "one.npz")
    assert record is not None
    for number, read in zip(numbers, record.value["motion"], strict=True):
        np.testing.assert_array_equal(read, number, strict=True)
    assert record.value["again"] is record.value["motion"][3]
    for name in ("one", "turned", "large", "true"):
        np.testing.assert_array_equal(record.value[name], value[name], strict=True)
    np.testing.assert_array_equal(record.value["words"][1], np.array(["bc"]), strict=True)
    record.value["motion"][4][:] = 0.0  # an array of its own
    np.testing.assert_array_equal(record.value["motion"][3], numbers[3])


def test_the_same_value_is_the_same_bytes(file: Path) -> None:
    before = file.read_bytes()
    write_record(file, Record(value=VALUE, name="curve", key="abc", seconds=1.5))
    assert file.read_bytes() == before


def test_what_is_not_there_is_none(tmp_path: Path) -> None:
    assert read_record(tmp_path / "absent.npz") is None
    assert not is_intact(tmp_path / "absent.npz")


def test_any_changed_byte_and_any_missing_end_is_noticed(file: Path) -> None:
    whole = file.read_bytes()
    for place in range(0, len(whole), 7):
        changed = bytearray(whole)
        changed[place] ^= 1
        for damaged in (bytes(changed), whole[:place]):
            file.write_bytes(damaged)
            assert not is_intact(file)
            with pytest.raises(DamagedRecord, match=r"one\.npz"):
                read_record(file)


def test_a_whole_archive_of_another_form_counts_as_damaged(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", a=np.arange(3))
    with pytest.raises(DamagedRecord):
        read_record(tmp_path / "other.npz")


def test_a_value_that_cannot_be_stored_leaves_the_record_before(file: Path) -> None:
    before = file.read_bytes()
    with pytest.raises(TypeError, match="cannot be stored"):
        write_record(file, Record(value=print))
    assert [item.read_bytes() for item in file.parent.iterdir()] == [before]


#: Writes a record in place of the one before, and is killed, or finds the disk full, after the array.
INTERRUPTED = """
import os, resource, signal, sys
from pathlib import Path
import numpy as np
from pipeline import record
def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)
if sys.argv[1] == "kill":
    record._compute_checksum = kill
else:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
record.write_record(Path(sys.argv[2]), record.Record(value=np.zeros(10_000)))
"""


@pytest.mark.parametrize(("how", "code", "n_file"), [("kill", -signal.SIGKILL, 2), ("full", 1, 1)])
def test_a_write_that_ends_in_the_middle_leaves_the_record_before(file: Path, how: str, code: int, n_file: int) -> None:
    before = file.read_bytes()
    command = [sys.executable, "-c", INTERRUPTED, how, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env=dict(os.environ))
    assert done.returncode == code, done.stderr
    assert how == "kill" or f"OSError: [Errno 27] File too large: '{file}'" in done.stderr
    assert file.read_bytes() == before
    assert len(list(file.parent.iterdir())) == n_file
    check: Callable[..., Any] = read_record
    assert check(file).key == "abc"
