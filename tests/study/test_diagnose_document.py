"""What docs/diagnose.md shows is run as it stands, and a user's own effect takes part from case to verdict."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from correlation.campaign.read_campaign import read_campaign
from pipeline.store import Store
from study import cli
from study.case.setup import read_case
from study.diagnose.history import read_text
from study.diagnose.run import diagnose_file

TwoMasses = Callable[..., Path]
ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs" / "diagnose.md").read_text(encoding="utf-8")
CASE_PAGE = (ROOT / "docs" / "case.md").read_text(encoding="utf-8")


def test_the_ten_lines_of_the_document_run(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, kept_rounds: Store
) -> None:
    case = two_masses({"mass at tip": 0.006}).rename("beam.toml")
    monkeypatch.setenv("STICKSLIP_CACHE", str(kept_rounds.folder))
    drawn = read_text(case)
    code = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)[0]
    exec(compile(code, "docs/diagnose.md", "exec"), {})
    told = capsys.readouterr().out
    assert re.search(r"^Mass at tip .* is missing", told)
    after, before = map(float, told.splitlines()[-1].split(" was "))
    assert after == before  # the same step, there and back
    assert read_text(case) == drawn


def test_the_tables_of_the_case_page_make_a_case(tmp_path: Path) -> None:
    tables = re.search(r"(    \[calibrated\]\n.*?)\n\n## ", CASE_PAGE, re.DOTALL)
    assert tables is not None
    shipped = ROOT / "study" / "cases" / "beam"
    for name in ("beam.npz", "beam_finer.npz", "beam_finer.toml"):
        (tmp_path / name).write_bytes((shipped / name).read_bytes())
    text = (shipped / "beam.toml").read_text(encoding="utf-8")
    case = tmp_path / "beam.toml"
    case.write_text(text + re.sub(r"(?m)^    ", "", tables[1]), encoding="utf-8")
    setup = read_case(case).setup
    assert setup.calibrated == {"kt": 1.0153, "mu": 0.97}
    assert setup.added[0].values.tolist() == [52.4e-6]


def test_an_effect_of_ones_own_is_found_added_and_compared(two_masses: TwoMasses) -> None:
    name = "third harmonic of the exciter"
    two_masses({})
    shutil.copy(ROOT / "examples" / "effects" / "exciter_third_harmonic.py", "mine.py")
    case, folder = Path("chain.toml"), Path("campaign")
    case.write_text(f'{read_text(case)}\n[effects]\nfiles = ["mine.py"]\n', encoding="utf-8")
    two_masses({name: 0.05}, case=read_text(case))
    done = diagnose_file(case, read_campaign(folder), folder, without=["spring", "dashpot", "cubic"], auto=True)
    assert [item.diagnosis.verdict.finding.value for item in done.rounds] == ["missing", "nothing"]
    assert [step.effect for step in done.history.active_steps] == [name]
    (added,) = read_case(case).setup.added
    assert added.values[0] == pytest.approx(0.05, rel=0.02)
    assert cli.main(["compare", "chain.toml", "campaign", "--quiet"]) == 0
