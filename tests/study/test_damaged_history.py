"""A history that is damaged, or says what no case can be, is refused in a sentence and changes nothing."""

from pathlib import Path

import pytest

from geometry.errors import InputError
from study.diagnose.add import find_case, undo
from study.diagnose.history import ADD, History, HistoryStep, history_of

TEXT = 'schema = 2\n[structure]\nkind = "plain"\nfile = "m.npz"\n'


@pytest.mark.parametrize(
    "before", ["x = " + "9" * 5000, "x = " + "[" * 5000, "x = ["], ids=["digits", "brackets", "cut"]
)
def test_an_effect_is_not_taken_back_into_a_text_that_is_no_case(tmp_path: Path, before: str) -> None:
    case = tmp_path / "a.toml"
    case.write_text(TEXT)
    step = HistoryStep(what=ADD, effect="mass at tip", case_before=before, case_after=TEXT)
    History(file=tmp_path / "a.history.json", steps=(step,)).save()
    with pytest.raises(InputError, match="were edited since"):
        undo(case)
    assert case.read_text() == TEXT


@pytest.mark.parametrize(
    "content",
    ["", "[" * 5000, '{"schema": 1, "steps": [1]}', '{"schema": ' + "9" * 5000 + "}", '{"steps": []}', "null"],
    ids=["empty", "brackets", "number", "digits", "no schema", "null"],
)
def test_a_damaged_history_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.history.json").write_text(content)
    with pytest.raises(InputError, match=r"a\.history\.json"):
        history_of(tmp_path / "a.toml")


def test_an_endless_file_beside_the_case_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(TEXT)
    (tmp_path / "b.toml").symlink_to("/dev/zero")
    (tmp_path / "c.toml").write_text("x = " + "[" * 5000)
    assert find_case(tmp_path) == tmp_path / "a.toml"
    (tmp_path / "a.history.json").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="device"):
        history_of(tmp_path / "a.toml")
