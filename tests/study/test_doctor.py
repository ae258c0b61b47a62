"""The doctor finds what is missing without crashing on it, and its one line would mend it."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from geometry import system_library
from geometry.errors import MissingSoftware
from study import doctor


@pytest.fixture
def without_a_library(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let one library of pictures be one that no machine has."""
    monkeypatch.setitem(system_library.SYSTEM_LIBRARIES, "pictures", (("libNowhere.so.7", "libNeither.so.1"),))
    monkeypatch.setitem(system_library.DEBIAN_PACKAGE, "libNowhere.so.7", "libnowhere7")
    system_library.missing_libraries.cache_clear()
    yield
    system_library.missing_libraries.cache_clear()


def test_preflight_names_the_library_and_the_line_that_installs_it(without_a_library: None) -> None:
    with pytest.raises(MissingSoftware, match=r"libNowhere\.so\.7: install with `.*apt-get install .* libnowhere7`"):
        system_library.require_system_libraries("cad", "pictures")


def test_of_several_that_serve_one_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(system_library.SYSTEM_LIBRARIES, "pictures", (("libNowhere.so.7", "libc.so.6"),))
    system_library.missing_libraries.cache_clear()
    assert system_library.missing_libraries("pictures") == ()
    system_library.missing_libraries.cache_clear()


def test_what_is_missing_is_told_and_prescribed(without_a_library: None, tmp_path: Path) -> None:
    findings = doctor.examine(tmp_path)
    missing = {finding.subject: finding.detail for finding in findings if finding.verdict == "missing"}
    assert missing["system libraries"] == "libNowhere.so.7 for off-screen pictures (pyvista)"
    assert missing["off-screen picture"] == "not tried, since its libraries are missing"
    assert "libnowhere7" in doctor.make_install_command(findings)


def test_a_crash_while_drawing_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "TEST_PICTURE", "import os; os.kill(os.getpid(), 11)")
    finding = doctor._check_picture()
    assert (finding.verdict, finding.detail) == ("missing", "drawing crashed with signal 11")


def test_a_driver_that_hangs_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "TEST_PICTURE", "import time; time.sleep(60)")
    monkeypatch.setattr(doctor, "PICTURE_TIMEOUT", 0.1)
    assert doctor._check_picture().detail == "no picture after 0 s"


def test_a_cache_that_cannot_be_written_is_told_but_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    finding = doctor._check_cache(tmp_path / "file" / "cache")
    assert (finding.verdict, finding.is_needed) == ("missing", False)
    assert "set STICKSLIP_CACHE" in finding.detail


@pytest.mark.parametrize("found", [None, "libNowhere.so.7"], ids=["not there", "does not load"])
def test_without_cholmod_all_that_is_needed_is_there(found: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.ctypes.util, "find_library", lambda _name: found)
    finding = doctor._check_cholmod()
    assert (finding.verdict, finding.is_needed, finding.apt) == ("missing", False, ())
    assert "apt-get install libcholmod5, or libcholmod3 on Debian 12" in finding.detail


def test_this_machine_can_run_the_tests(tmp_path: Path) -> None:
    findings = doctor.examine(tmp_path)
    assert [finding for finding in findings if finding.is_needed and finding.verdict != "ok"] == []


def test_it_needs_nothing_but_the_standard_library() -> None:
    # -S leaves site-packages out, so any third-party import fails; the packages themselves are put on the path.
    root = Path(doctor.__file__).parents[1]
    path = f"import sys; sys.path.insert(0, {str(root)!r})"
    script = f"{path}; import study.doctor; from geometry import system_library as s; print(s.missing_libraries('cad'))"
    done = subprocess.run([sys.executable, "-S", "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "()\n"), done.stderr


def test_the_check_of_libraries_imports_nothing_heavy() -> None:
    script = (
        "import sys; from geometry.system_library import require_system_libraries; "
        "require_system_libraries('cad', 'pictures'); "
        "print([m for m in ('numpy', 'vtkmodules', 'cadquery', 'pyvista') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
