"""An output is refused before work begins, or written whole."""

import errno
import os
import stat
from pathlib import Path

import pytest

from geometry.errors import OutputError
from pipeline.output import describe_system_failure, prepare_output, removed_if_empty, replace_file


def test_a_new_folder_is_made_with_its_parents_and_stays_empty(tmp_path: Path) -> None:
    folder = prepare_output(tmp_path / "a" / "b")
    assert list(folder.iterdir()) == []


def test_a_folder_with_files_keeps_them(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("x")
    assert list(prepare_output(tmp_path).iterdir()) == [tmp_path / "mine.txt"]


def test_a_file_in_its_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("x")
    with pytest.raises(OutputError, match="/out is a file: name another folder with --out"):
        prepare_output(tmp_path / "out")
    with pytest.raises(OutputError, match="/out/deeper cannot be written"):
        prepare_output(tmp_path / "out" / "deeper")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"):
        prepare_output(tmp_path)
    tmp_path.chmod(0o700)


def test_what_fails_leaves_no_empty_folder_and_keeps_all_others(tmp_path: Path) -> None:
    def interrupted(name: str) -> None:
        folder = prepare_output(tmp_path / name)
        if name == "full/deep":
            (folder / "table.csv").write_text("x")
        raise KeyboardInterrupt

    (tmp_path / "mine").mkdir()
    for name in ("mine", "new/deep", "full/deep"):
        with pytest.raises(KeyboardInterrupt), removed_if_empty():
            interrupted(name)
    assert sorted(str(item.relative_to(tmp_path)) for item in tmp_path.rglob("*")) == [
        "full",
        "full/deep",
        "full/deep/table.csv",
        "mine",
    ]
    with removed_if_empty():
        prepare_output(tmp_path / "done")
    assert (tmp_path / "done").is_dir()


def test_a_file_is_replaced_whole_with_ordinary_permissions(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_text("old")
    replace_file(file, "né\n")
    assert file.read_bytes() == "né\n".encode()
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(file.stat().st_mode) == 0o666 & ~umask
    assert list(tmp_path.iterdir()) == [file]


def test_a_write_that_fails_leaves_the_old_file_and_no_litter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "table.csv"
    file.write_text("old")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="No space"):
        replace_file(file, "new")
    assert list(tmp_path.iterdir()) == [file]
    assert file.read_text() == "old"


def test_a_file_that_the_disk_does_not_take_is_named_and_the_old_one_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "result.csv"
    file.write_text("old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space") as failed:
        replace_file(file, "new")
    assert str(file) in (describe_system_failure(failed.value) or "")
    assert [path.name for path in tmp_path.iterdir()] == ["result.csv"]
    assert file.read_text() == "old"


def test_too_many_open_files_name_the_limit() -> None:
    for error in (OSError(errno.EMFILE, "Too many open files"), OSError("unable to open (errno = 24)")):
        assert "ulimit" in (describe_system_failure(error) or "")


def test_other_errors_are_no_failure_of_the_disk() -> None:
    assert describe_system_failure(OSError(errno.ENOENT, "No such file")) is None
    assert describe_system_failure(ValueError("x = 28")) is None
