"""A case is edited as by hand: what it says changes as asked, all else stays, and a step back restores every byte."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from casefile.errors import CaseError
from study.diagnose.edit import Written, edit_case, list_changes, revert_change
from study.shipped_cases import BEAM

BEAM_TEXT = BEAM.read_text(encoding="utf-8")
MASS = {"mass at tip": {"mass": Written(value="52.4 mg", note="1.1 mg")}}
FACTORS = {"kt": Written(value=1.0153, note="0.0021"), "mu": Written(value=0.98, note="0.01")}


def test_new_tables_stand_at_the_end_and_nothing_else_moves() -> None:
    text = edit_case(BEAM_TEXT, MASS, FACTORS)
    assert text.startswith(BEAM_TEXT)
    data = tomllib.loads(text)
    assert data["added"] == [{"effect": "mass at tip", "mass": "52.4 mg"}]
    assert data["calibrated"] == {"kt": 1.0153, "mu": 0.98}
    assert 'mass = "52.4 mg" # +- 1.1 mg\n' in text
    assert [line for line in list_changes(BEAM_TEXT, text, "beam.toml") if line.startswith("-")] == [
        "--- beam.toml\tbefore"
    ]


def test_values_that_are_there_change_in_place_and_the_users_comments_stay() -> None:
    before = (
        'schema = 2\n[[added]] # found in May\neffect = "mass at tip"\nmass = "50 mg" # weighed\n\n'
        "[calibrated]\nkt = 1.0 # +- 0.1\nmu=0.9 # see the log\n[other]\nx = 1\n"
    )
    assert edit_case(before, MASS, FACTORS) == before.replace('"50 mg"', '"52.4 mg"').replace(
        "kt = 1.0 # +- 0.1", "kt = 1.0153 # +- 0.0021"
    ).replace("mu=0.9 ", "mu=0.98 ")


def test_a_value_without_an_interval_takes_away_that_of_the_value_before() -> None:
    before = '[[added]]\neffect = "mass at tip"\nmass = "50 mg" # +- 1.1 mg\n'
    own = {
        effect: {key: Written(value=value, note="") for key, (value, _) in values.items()}
        for effect, values in MASS.items()
    }
    assert edit_case(before, own, {}) == before.replace('"50 mg" # +- 1.1 mg', '"52.4 mg"')


@pytest.mark.parametrize("text", [BEAM_TEXT, BEAM_TEXT.rstrip(), BEAM_TEXT.replace("\n", "\r\n"), "\ufeffschema = 2\n"])
def test_a_step_back_restores_every_byte(text: str) -> None:
    once = edit_case(text, MASS, FACTORS)
    twice = edit_case(once, {"cubic at tip": {"stiffness": Written(value="3 N/mm^3")}}, FACTORS)
    assert revert_change(once, twice, twice) == once
    assert revert_change(text, once, once) == text
    assert ("\r\n" in text) == ("\r\n" in once)


@given(st.integers(0, BEAM_TEXT.count("\n") - 2), st.sampled_from(["# a note\n", "\n", "# two\n# lines\n"]))
def test_what_was_edited_elsewhere_survives_a_step_back(line: int, note: str) -> None:
    added = edit_case(BEAM_TEXT, MASS, FACTORS)

    def with_note(text: str) -> str:
        lines = text.splitlines(keepends=True)
        return "".join([*lines[:line], note, *lines[line:]])

    assert revert_change(BEAM_TEXT, added, with_note(added)) == with_note(BEAM_TEXT)


def test_lines_that_were_edited_are_not_taken_back() -> None:
    once = edit_case(BEAM_TEXT, MASS, FACTORS)
    assert revert_change(BEAM_TEXT, once, once.replace("52.4", "53")) is None
    twice = edit_case(once, {"mass at tip": {"mass": Written(value="60 mg")}}, {})
    assert revert_change(once, twice, twice.replace("60 mg", "61 mg")) is None
    assert revert_change(once, twice, f"{twice}# the end\n") == f"{once}# the end\n"


def test_a_layout_that_cannot_be_edited_is_refused() -> None:
    inline = 'schema = 2\nadded = [{ effect = "gap of left at left.1", gap = "1 um" }]\n'
    with pytest.raises(CaseError, match=r"my.toml: cannot be edited .*: write the effect into it by hand"):
        edit_case(inline, MASS, {}, "my.toml")
    changed = edit_case(inline, {"gap of left at left.1": {"gap": Written(value="2 um")}}, {})
    assert changed == inline.replace("1 um", "2 um")


def test_a_lower_bound_is_not_written_as_an_interval() -> None:
    bound = {"mu": Written(1.01179, "a lower bound; first estimate from loop")}
    text = edit_case("[calibrated]\nmu = 1.0\n", {}, bound)
    assert text == "[calibrated]\nmu = 1.01179 # a lower bound; first estimate from loop\n"
    # The next interval takes its place.
    assert edit_case(text, {}, {"mu": Written(1.0, "0.1")}) == "[calibrated]\nmu = 1.0 # +- 0.1\n"
    assert "# a lower bound" in edit_case("", {}, bound)


def test_tables_of_one_kind_among_others_stay_in_their_order() -> None:
    text = '[[place]]\nname = "a"\n\n[[sensor]]\nname = "x"\n\n[[place]]\nname = "b"\n\n[[sensor]]\nname = "y"\n'
    once = edit_case(text, {}, {"kt": Written(1.5, "0.1")})
    assert once == f"{text}\n[calibrated]\nkt = 1.5 # +- 0.1\n"
    assert edit_case(once, {}, {"kt": Written(2.5, "0.1")}) == once.replace("1.5", "2.5")
