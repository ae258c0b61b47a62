"""A mistake in many files is printed once; what tells mistakes apart is kept."""

from dataclasses import replace

from correlation.campaign.measurement import Suspicion
from study.compare.sentence import doubt, judge
from study.merge_sentences import merge_similar, merge_suspicions


def test_sentences_that_differ_by_file_and_numbers_are_one() -> None:
    lines = [
        f'campaign.toml: run[{number}].columns.x0: "a0" of s_{number}.csv is not finite at 1 of 17 rows'
        for number in (1, 2, 3)
    ]
    (merged,) = merge_similar(lines)
    assert merged == f"{lines[0]} (also in s_2.csv, s_3.csv)"
    (merged,) = merge_similar([lines[0].replace("s_1", f"s_{number}") for number in range(1, 7)])
    assert merged.endswith("(also in 5 more files, the last s_6.csv)")


def test_sentences_of_other_columns_or_without_a_file_are_apart() -> None:
    lines = ['s_1.csv: "x0" is dead', 's_1.csv: "x3" is dead', "repeat 3 differs", "repeat 4 differs"]
    assert merge_similar(lines) == lines


def test_one_sentence_of_many_places_is_printed_once_with_their_names() -> None:
    lines = [f"decay {number}: instants are rounded" for number in range(1, 7)]
    assert merge_similar(lines) == [f"{lines[0]} (also decay 2, decay 3, decay 4 and 2 more)"]


def test_remarks_of_many_places_are_one_and_suspected_places_stay_apart() -> None:
    for remark in (True, False):
        result = [Suspicion(where=f"decay {number}", sentence="is odd", remark=remark) for number in (1, 2)]
        assert [item.where for item in merge_suspicions(result)] == ["decay 1"] if remark else ["decay 1", "decay 2"]


def test_suspicions_keep_the_place_of_the_first() -> None:
    result = [Suspicion(where=f"s_{number}.csv", sentence=f"reaches {number} rad") for number in (5, 6)]
    (merged,) = merge_suspicions(result)
    assert merged.where == "s_5.csv"
    assert merged.sentence.startswith("reaches 5 rad")
    assert "so in s_6.csv" in merged.sentence
    assert merged.alike == ("s_6.csv",)


def test_a_headline_counts_all_places_of_one_suspicion() -> None:
    result = [Suspicion(where=f"s_{number}.csv", sentence=f"reaches {number} rad") for number in range(1, 7)]
    assert doubt(merge_suspicions(result)).endswith("look wrong: s_1.csv; s_2.csv; s_3.csv and 3 more")


def test_many_sentences_that_differ_by_names_in_quotes_are_one_with_the_first_names() -> None:
    lines = [f'sine.h5: the phase "run_{run}/{name}" reaches {170 + run} rad' for run in (1, 2, 3) for name in "ab"]
    (merged,) = merge_similar(lines)
    assert merged == f'{lines[0]} (also "run_1/b", "run_2/a", "run_2/b" and 2 more)'
    (merged,) = merge_similar(lines, naming_all=True)
    assert all(f'"run_{run}/{name}"' in merged for run in (1, 2, 3) for name in "ab")
    assert merge_similar(lines[:3]) == lines[:3]


def test_a_headline_of_its_own_stands_in_place_of_where_and_agreement_stays_in_doubt() -> None:
    changed = Suspicion(where='test "sine"', sentence="wear?", headline='test "sine" changed', of_time=True)
    tone, tag = judge(0.5, (), [changed])
    assert tag == 'The model agrees with the measurements within noise and stated errors; test "sine" changed'
    assert tone == "ambiguous"
    assert judge(0.5, (), [replace(changed, remark=True)])[0] == "nothing"
