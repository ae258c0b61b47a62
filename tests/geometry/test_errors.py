"""Messages show what a terminal may show, whatever stood in a file."""

import pickle

from casefile.errors import CaseError, Problem
from geometry.errors import LONGEST_WORD, InputError, SelectorError


def test_control_characters_of_a_file_do_not_reach_the_terminal() -> None:
    hostile = "name \x1b[2J\x07 \u202e\udc80 is wrong"
    for error in (InputError(hostile), CaseError([Problem(file="a.toml", line=1, key="", text=hostile)])):
        assert str(error).isprintable()
        assert "is wrong" in str(error)


def test_lines_umlauts_and_long_paths_stay() -> None:
    text = "Prüfer µm\n/" + "folder/" * 50
    assert str(InputError(text)) == text


def test_an_endless_word_is_cut() -> None:
    assert len(str(InputError("9" * 100_000 + " is too large"))) < LONGEST_WORD + 30


def test_an_error_comes_back_from_another_process() -> None:
    error = pickle.loads(pickle.dumps(SelectorError("no face", "slot", 2)))
    assert str(error) == "no face"
    assert (error.region, error.number) == ("slot", 2)
