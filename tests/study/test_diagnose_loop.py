"""The loop as a user runs it: a hidden mass is named, added, the error falls; each step is noted, and taken back."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.prediction import Predictor
from pipeline.output import replace_file
from pipeline.store import Store
from study import cli
from study.beam.case import write_beam_case
from study.case.setup import read_case
from study.compare.run import compare
from study.diagnose.add import add, find_case, undo
from study.diagnose.history import hash_case, history_of, read_text
from study.diagnose.round import diagnose_case
from study.diagnose.run import diagnose_file, record_diagnosis
from study.run_context import silent_run
from tests.slow import slow

TwoMasses = Callable[..., Path]
HIDDEN = {"mass at tip": 0.006}
#: Kinds that are left out where any candidate will do.
FEW = ("spring", "dashpot", "cubic")


def test_a_hidden_mass_is_named_added_and_the_error_falls(two_masses: TwoMasses, kept_rounds: Store) -> None:
    case, folder = two_masses(HIDDEN), Path("campaign")
    drawn, campaign = read_text(case), read_campaign(folder)
    result = diagnose_case(read_case(case, campaign).setup, campaign, store=kept_rounds)
    assert [item.effect.name for item in result.diagnosis.verdict.effects if item.effect] == ["mass at tip"]
    # Three standard deviations of its own.
    assert result.best is not None
    assert result.best.strength == pytest.approx(0.006, abs=3 * result.best.deviation)
    record_diagnosis(result, case, folder)

    step = add(case, "Mass at  tip")
    assert step.before is not None
    assert step.after is not None
    # Noise of 0.2 % is left of an error that a resonance a quarter of a per cent off makes.
    assert step.after.held_out < 0.05 * step.before.held_out
    setup = read_case(case).setup
    # The case is the fitted model: six digits are written, and the mass of the place is 0.5 kg.
    np.testing.assert_allclose(setup.complete.system.mass, result.best.fit.model.system.mass, rtol=1e-7)
    np.testing.assert_allclose(setup.complete.system.damping, result.best.fit.model.system.damping, rtol=1e-5)
    before, after = (compare(item, campaign).train.whitened for item in (_plain(drawn), setup))
    assert np.nanmean(after**2) < 1.5 < 10 < np.nanmean(before**2)

    again = diagnose_case(read_case(case, campaign).setup, campaign, store=kept_rounds)
    assert again.diagnosis.verdict.finding.value == "nothing"
    assert undo(case).effect == "mass at tip"
    assert read_text(case) == drawn
    assert [item.what for item in history_of(case).steps] == ["diagnosis", "add", "undo"]
    assert history_of(case).active_steps == ()


def _plain(text: str):  # type: ignore[no-untyped-def]
    """The case as it was drawn, from a copy."""
    copy = Path("drawn.toml")
    copy.write_text(text, encoding="utf-8")
    setup = read_case(copy).setup
    copy.unlink()
    return setup


def test_auto_goes_on_until_nothing_is_missing_and_a_second_run_computes_nothing(
    two_masses: TwoMasses, capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = two_masses(HIDDEN)
    drawn = read_text(case)
    words = ["diagnose", "chain.toml", "campaign", "--auto", "--out", "out", "--json"]
    words += [word for kind in FEW for word in ("--without", kind)]
    assert cli.main(words) == 0
    document = json.loads(capfdbinary.readouterr().out)
    assert [item["finding"] for item in document["rounds"]] == ["missing", "nothing"]
    assert [(item["what"], item["effect"]) for item in document["history"]] == [("add", "mass at tip")]
    (candidate,) = [item for item in document["rounds"][0]["candidates"] if item["named"]]
    assert candidate["strength"] == pytest.approx(0.006, rel=0.1)
    assert {item["effect"] for item in document["untestable"]} >= {"preload", "gap"}
    errors = document["history"][0]
    assert errors["errors_after"]["held_out"] < 0.05 * errors["errors_before"]["held_out"]
    assert json.loads(Path("out/chain_diagnosis.json").read_text())["verdict"] == document["verdict"]

    assert cli.main(["undo"]) == 0
    assert read_text(case) == drawn
    monkeypatch.setattr(Predictor, "predict", lambda *_: pytest.fail("something is computed again"))
    capfdbinary.readouterr()
    # The rounds, and what their pages draw, are found again; the figures alone are drawn anew.
    assert cli.main(words) == 0
    again = json.loads(capfdbinary.readouterr().out)
    assert again["rounds"] == document["rounds"]


@slow
def test_an_interrupted_round_goes_on_where_it_was(two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch) -> None:
    case = two_masses(HIDDEN)
    campaign, store = read_campaign(Path("campaign")), Store(Path("kept"))
    setup = replace(read_case(case, campaign).setup, without=FEW)
    whole, predict = 0, Predictor.predict

    def counted(*arguments):  # type: ignore[no-untyped-def]
        nonlocal whole
        whole += 1
        if whole == most:
            raise KeyboardInterrupt
        return predict(*arguments)

    monkeypatch.setattr(Predictor, "predict", counted)
    most = -1
    diagnose_case(setup, campaign)
    all_of_it, whole, most = whole, 0, 2 * whole // 3
    with pytest.raises(KeyboardInterrupt):
        diagnose_case(setup, campaign, store=store)
    assert store.size()[0] >= 1
    whole, most = 0, -1
    diagnose_case(setup, campaign, store=store)
    # What was finished is not done again; the step that was interrupted is, be it a long one.
    assert 0 < whole < all_of_it


@slow
def test_another_case_or_campaign_is_another_round(two_masses: TwoMasses) -> None:
    case = two_masses(HIDDEN)
    campaign, store = read_campaign(Path("campaign")), Store(Path("kept"))
    first = diagnose_case(read_case(case, campaign).setup, campaign, store=store, without=FEW)
    case.write_text(read_text(case).replace("highest = 3", "highest = 4"), encoding="utf-8")
    second = diagnose_case(read_case(case, campaign).setup, campaign, store=store, without=FEW)
    assert second.diagnosis.arrangement.base.n_harmonic == first.diagnosis.arrangement.base.n_harmonic + 1


def test_a_given_value_needs_no_diagnosis(two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]) -> None:
    case = two_masses(HIDDEN)
    drawn = read_text(case)
    assert cli.main(["add", "mass", "at", "tip", "--value", "5 g"]) == 0
    assert 'mass = "5 g"' in read_text(case)
    assert read_text(case).startswith(drawn)
    assert cli.main(["add", "spring at base", "--case", "chain.toml", "--value", "-3 N/mm"]) == 0
    assert [item.effect for item in history_of(case).active_steps] == ["mass at tip", "spring at base"]
    case.write_text(read_text(case).replace("as drawn.", "as drawn by me."), encoding="utf-8")
    assert cli.main(["undo"]) == 0
    assert cli.main(["undo"]) == 0
    assert read_text(case) == drawn.replace("as drawn.", "as drawn by me.")
    assert "taken back" in capsys.readouterr().out


def test_comments_do_not_make_a_diagnosis_stale_but_values_do(two_masses: TwoMasses) -> None:
    text = read_text(two_masses({}))
    assert hash_case(text) == hash_case(f"# a note\n{text}")
    assert hash_case(text) != hash_case(text.replace("highest = 3", "highest = 5"))


REFUSALS = [
    (("diagnose", "chain.toml", "nowhere"), r"nowhere"),
    (("diagnose", "chain.toml", "campaign", "--without", "cubics"), '"cubics" is not a kind of effect: leave out any'),
    (("diagnose", "chain.toml", "campaign", "--trials", "1"), "--trials 1 is too few: give 0 for linear theory"),
    (("diagnose", "nothing.toml", "campaign"), "nothing.toml: there is no such case file"),
    (("diagnose", "chain.toml", "campaign", "--out", "chain.toml"), "the output folder chain.toml is a file"),
    (("add", "mass at tip"), "it has no diagnosis, from which .*: run stickslip diagnose, or give --value"),
    (("add", "mas at tip"), 'there is no effect "mas at tip"; did you mean "mass at tip"'),
    (("add", "preload"), 'the effect "preload" cannot act in this case: the model has no contact lines'),
    (("add", "mass at tip", "--value", "5 mm"), '--value "5 mm": "mm" makes it a length'),
    (("add", "mass at tip", "--value", "5 g", "--value", "2"), r'"mass at tip" has 1 values \(mass\), not 2'),
    (("add",), "no effect is named: give one as the diagnosis writes it"),
    (("add", "mass at tip", "--case", "other.toml"), "other.toml: there is no such case file"),
    (("undo",), "nothing was added by stickslip, so there is nothing to undo"),
]


@pytest.mark.parametrize(("words", "message"), REFUSALS)
def test_bad_input_is_one_sentence(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    two_masses(HIDDEN)
    assert cli.main([*words, "--quiet"]) == 2
    told = capsys.readouterr().err.strip()
    assert re.search(message, told)
    assert "\n" not in told


def test_nothing_held_out_is_refused(two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]) -> None:
    two_masses(HIDDEN, held_out=False)
    assert cli.main(["diagnose", "chain.toml", "campaign", "--quiet"]) == 2
    assert "nothing is held out, so neither a fit nor an effect can be tested: name a level" in capsys.readouterr().err


def test_time_records_alone_are_refused(two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]) -> None:
    two_masses(HIDDEN)
    for file in Path("campaign").iterdir():
        file.unlink()
    sensor = '[[sensor]]\nname = "tip"\nquantity = "displacement"\ndirection = "z"\nplace = "tip"\n'
    record = '[[record]]\nname = "ring"\nfile = "ring.csv"\nunits = { tip = "um" }\n'
    Path("campaign/campaign.toml").write_text(f"schema = 1\n{sensor}{record}", encoding="utf-8")
    Path("campaign/ring.csv").write_text("time,tip\n0,1\n1e-3,2\n2e-3,1.5\n", encoding="utf-8")
    assert cli.main(["diagnose", "chain.toml", "campaign", "--quiet"]) == 2
    assert "campaign contains only time records, which this command does not read" in capsys.readouterr().err


def test_an_edited_case_needs_a_new_diagnosis(
    two_masses: TwoMasses, kept_rounds: Store, capsys: pytest.CaptureFixture[str]
) -> None:
    case, folder = two_masses(HIDDEN), Path("campaign")
    diagnose_file(case, read_campaign(folder), folder, replace(silent_run(), store=kept_rounds))
    drawn = read_text(case)
    case.write_text(drawn.replace("highest = 3", "highest = 5"), encoding="utf-8")
    assert cli.main(["add", "mass at tip"]) == 2
    assert "edited since its last diagnosis" in capsys.readouterr().err
    case.write_text(drawn, encoding="utf-8")
    assert cli.main(["add", "dashpot at base"]) == 2
    assert "the last diagnosis did not fit" in capsys.readouterr().err
    assert cli.main(["add", "mass at tip"]) == 0
    assert cli.main(["add", "mass at tip"]) == 2
    assert "is in the case already" in capsys.readouterr().err
    case.write_text(read_text(case).replace("[[added]]", "[[added]]\n# mine"), encoding="utf-8")
    assert cli.main(["undo"]) == 2
    assert 'the lines of "mass at tip" were edited' in capsys.readouterr().err


def test_a_damaged_history_is_named(two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]) -> None:
    case = two_masses({})
    case.with_name("chain.history.json").write_text('{"schema": 1', encoding="utf-8")
    assert cli.main(["undo"]) == 2
    assert "chain.history.json: is damaged: correct it, or move it away" in capsys.readouterr().err


@pytest.mark.parametrize("locked", ["chain.history.json", "chain.toml"])
def test_a_folder_that_cannot_be_written_leaves_all_as_it_was(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, locked: str
) -> None:
    case = two_masses({})
    add(case, "spring at base", ["2 N/mm"])
    drawn, history = read_text(case), history_of(case)

    def refuse(file: Path, content: bytes) -> None:
        if file.name == locked:
            raise PermissionError(13, "Permission denied")
        replace_file(file, content)

    # Permissions mean nothing to root, who may run this.
    monkeypatch.setattr("study.diagnose.history.replace_file", refuse)
    for words in (("add", "mass at tip", "--value", "5 g"), ("undo",)):
        assert cli.main([*words]) == 2
        assert re.search(rf"{locked} cannot be written \(Permission denied\): change", capsys.readouterr().err)
        assert read_text(case) == drawn
        assert history_of(case) == history


def test_one_case_of_a_folder_is_found(two_masses: TwoMasses) -> None:
    case = two_masses({})
    assert find_case(Path()).resolve() == case
    case.with_name("second.toml").write_text(read_text(case), encoding="utf-8")
    with pytest.raises(
        Exception, match=r"there are 2 cases \(chain.toml, second.toml\) in .*: name the case with --case"
    ):
        find_case(Path())
    add(case, "mass at tip", ["5 g"])
    assert find_case(Path()).resolve() == case


def test_the_finer_case_of_another_is_none_of_its_own(tmp_path: Path) -> None:
    case = write_beam_case(tmp_path)
    assert len([*tmp_path.glob("*.toml")]) == 2
    assert find_case(tmp_path) == case
