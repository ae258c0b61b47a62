"""Python files that a case names run only if they are the user's own, or the user has said so."""

import io
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from study.case.trust import UntrustedCode, is_own, require_trust, trust_code, trusting
from study.cli import main
from study.kind.registry import open_case

CODE = 'from pathlib import Path\nPath(__file__).with_name("was_run").touch()\n'
CASE = """\
schema = 2
[structure]
kind = "plain"
file = "m.npz"
[plugins]
files = ["code.py"]
"""


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    home = tmp_path / "case"
    home.mkdir()
    (home / "code.py").write_text(CODE)
    (home / "case.toml").write_text(CASE)
    yield home / "case.toml"
    trust_code(False)


def answer(monkeypatch: pytest.MonkeyPatch, words: str) -> io.StringIO:
    """Let a terminal answer; returns what is left of its words."""
    terminal = io.StringIO(words)
    terminal.isatty = lambda: True  # type: ignore[method-assign]
    monkeypatch.setattr("sys.stdin", terminal)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    return terminal


def was_run(case: Path) -> bool:
    with pytest.raises(Exception, match=r".") as refused:  # the code registers nothing, so that it is refused anyway
        open_case(case)
    del refused
    return case.with_name("was_run").exists()


def test_the_user_s_own_code_runs_without_a_question(case: Path) -> None:
    assert is_own(case.with_name("code.py"))
    assert was_run(case)


@pytest.mark.parametrize("place", ["case/code.py", "case"])
def test_code_that_others_may_change_is_refused_before_it_runs(case: Path, place: str) -> None:
    Path(place).chmod(0o777)
    assert not is_own(case.with_name("code.py"))
    assert not was_run(case)
    with pytest.raises(UntrustedCode, match=r"code\.py.*--trust"):
        require_trust([case.with_name("code.py")], case)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give a file away")
def test_code_of_another_user_is_refused(case: Path) -> None:
    os.chown(case.with_name("code.py"), 12345, 12345)
    assert not was_run(case)


def test_a_shared_folder_in_which_nobody_can_replace_files_of_others_is_one_s_own(case: Path) -> None:
    case.parent.chmod(0o1777)  # as /tmp
    assert is_own(case.with_name("code.py"))


def test_one_question_is_asked_and_a_yes_is_remembered_until_the_code_changes(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = case.with_name("code.py")
    code.chmod(0o666)
    terminal = answer(monkeypatch, "y\nno\n")
    require_trust([code], case)
    require_trust([code], case)
    assert terminal.read() == "no\n"
    answer(monkeypatch, "n\n")
    code.write_text(CODE + "# changed\n")
    with pytest.raises(UntrustedCode):
        require_trust([code], case)


def test_the_option_trusts_and_is_remembered(case: Path) -> None:
    code = case.with_name("code.py")
    code.chmod(0o666)
    assert main(["solve", str(case)]) == 2
    assert not case.with_name("was_run").exists()
    main(["solve", str(case), "--trust"])
    assert case.with_name("was_run").exists()
    trust_code(False)
    require_trust([code], case)


def test_a_block_trusts_and_no_longer(case: Path) -> None:
    code = case.with_name("code.py")
    code.chmod(0o666)
    with trusting():
        require_trust([code], case)
    code.write_text("# another\n")
    with pytest.raises(UntrustedCode):
        require_trust([code], case)


@pytest.mark.parametrize("content", ["", "{", "[1, null]", "[" * 5000, json.dumps({"a": 1})])
def test_a_damaged_memory_trusts_nothing(case: Path, content: str) -> None:
    code = case.with_name("code.py")
    code.chmod(0o666)
    memory = Path("cache/trusted_code.json")
    memory.parent.mkdir(exist_ok=True)
    memory.write_text(content)
    with pytest.raises(UntrustedCode):
        require_trust([code], case)
