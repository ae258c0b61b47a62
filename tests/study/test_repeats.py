"""What can be seen in a campaign at once is said at once, before minutes of computing."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from study import cli

TwoMasses = Callable[..., Path]
STEPPED = Path("campaign/test_01_stepped.csv")
MANIFEST = Path("campaign/campaign.toml")
HELD = "repeats = [4, 5]"


@pytest.fixture
def nothing_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("study.diagnose.run.diagnose_case", "study.compare.run.compare"):
        monkeypatch.setattr(package, lambda *_, **__: pytest.fail("a computation was started"))


@pytest.mark.usefixtures("nothing_computed")
@pytest.mark.parametrize("command", ["compare", "diagnose"])
def test_a_single_repeat_is_refused_at_once(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    two_masses({})
    head, *rows = STEPPED.read_text().splitlines()
    at = head.split(",").index("repeat")
    STEPPED.write_text("\n".join([head, *(row for row in rows if row.split(",")[at] == "1"), ""]))
    text = MANIFEST.read_text()
    assert HELD in text
    MANIFEST.write_text(text.replace(HELD, ""))
    assert cli.main([command, "chain.toml", "campaign", "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "campaign.toml: all data have repeat = 1: noise cannot be separated from effects; measure" in said
    assert said.count("\n") == 1


@pytest.mark.usefixtures("nothing_computed")
def test_nothing_held_out_is_refused_at_once(two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]) -> None:
    two_masses({}, held_out=False)
    assert cli.main(["diagnose", "chain.toml", "campaign"]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("stickslip: ")]
    assert "campaign.toml: nothing is held out, so neither a fit nor an effect can be tested: name a level" in line
    assert "e.g. repeats = [5]" in line


@pytest.mark.usefixtures("nothing_computed")
def test_all_that_one_repeat_lacks_is_said_at_once_with_a_measured_level(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]
) -> None:
    two_masses({}, held_out=False)
    head, *rows = STEPPED.read_text().splitlines()
    at = head.split(",").index("repeat")
    STEPPED.write_text("\n".join([head, *(row for row in rows if row.split(",")[at] == "1"), ""]))
    text = MANIFEST.read_text()
    assert cli.main(["diagnose", "chain.toml", "campaign", "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "noise cannot be separated from effects" in said
    (level,) = re.findall(r"e\.g\. levels = \[([\d.]+)\]", said)
    # It can be obeyed, and holding out the one repeat instead names the same.
    MANIFEST.write_text(f"{text}\n[held_out]\nlevels = [{level}]\n")
    assert read_campaign(Path("campaign")).held_out.levels == (float(level),)
    MANIFEST.write_text(f"{text}\n[held_out]\nrepeats = [1]\n")
    with pytest.raises(CampaignError, match=rf"everything.*levels = \[{level}\]"):
        read_campaign(Path("campaign"))


def test_a_suspicion_is_told_before_the_diagnosis(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    two_masses({})
    head, *rows = STEPPED.read_text().splitlines()
    at = head.split(",").index("frequency")
    turned = []
    for row in rows:
        fields = row.split(",")
        fields[at] = repr(6.283185307179586 * float(fields[at]))
        turned.append(",".join(fields))
    STEPPED.write_text("\n".join([head, *turned, ""]))

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("study.diagnose.run.diagnose_case", stop)
    cli.main(["diagnose", "chain.toml", "campaign", "--quiet"])
    assert 'write "rad/s" instead of "Hz" as the unit of that column' in capsys.readouterr().err


def test_a_step_back_in_a_case_that_is_not_there_says_so(at_home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    del at_home
    assert cli.main(["undo", "--case", "other.toml"]) == 2
    assert "other.toml: there is no such case file; check the spelling and the folder" in capsys.readouterr().err
