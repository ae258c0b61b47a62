"""Free memory, against what the files of Linux say."""

from pathlib import Path

import numpy as np
import pytest

from reduction.available_memory import MIN_CHECKED, describe_lacking_memory, read_available_memory


def test_what_is_free_is_the_least_that_the_system_tells(tmp_path: Path) -> None:
    assert read_available_memory(tmp_path) == np.inf
    (tmp_path / "proc").mkdir()
    (tmp_path / "proc/meminfo").write_text("MemTotal:       100 kB\nMemAvailable:    80 kB\n")
    assert read_available_memory(tmp_path) == 80 * 1024
    group = tmp_path / "sys/fs/cgroup"
    group.mkdir(parents=True)
    (group / "memory.max").write_text("max\n")
    (group / "memory.current").write_text("5000\n")
    assert read_available_memory(tmp_path) == 80 * 1024
    (group / "memory.max").write_text("50000\n")
    assert read_available_memory(tmp_path) == 45000
    assert 1e6 < read_available_memory() < np.inf or not Path("/proc/meminfo").exists()


def test_only_arrays_that_do_not_fit_are_lacking_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("reduction.available_memory.read_available_memory", lambda: 1e9)
    assert describe_lacking_memory(9e8) == ""
    assert describe_lacking_memory(2e9) == "about 2 GB of memory, but 1 GB are free"
    monkeypatch.setattr("reduction.available_memory.read_available_memory", lambda: 1.0)
    assert describe_lacking_memory(MIN_CHECKED) == ""
