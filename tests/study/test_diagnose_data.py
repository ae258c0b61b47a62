"""``stickslip diagnose`` without steady states: modes of a chain with a hidden mass, and a loop with play."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from diagnosis.feature.diagnose import diagnose_features
from geometry.errors import InputError
from study.bench.repeat import open_bench
from study.cli import main
from study.diagnose import data_run
from study.diagnose.history import hash_case, history_of
from study.diagnose.run import diagnose_file

CASE = """schema = 2
title = "Three masses"
[structure]
kind = "plain"
file = "chain.npz"
[[place]]
name = "left"
dof = 0
[[place]]
name = "middle"
dof = 1
[[place]]
name = "right"
dof = 2
[[load]]
place = "left"
[harmonics]
highest = 3
"""


def eigenfrequencies(mass: float) -> np.ndarray:
    stiffness = 4e4 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    return np.sqrt(np.sort(np.linalg.eigvals(np.diag([1, 1 / (1.2 + mass), 1 / 0.7]) @ stiffness).real)) / (2 * np.pi)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    stiffness = 4e4 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    np.savez(tmp_path / "chain.npz", M=np.diag([1.0, 1.2, 0.7]), K=stiffness, C=1e-4 * stiffness)
    (tmp_path / "chain.toml").write_text(CASE, encoding="utf-8")
    (tmp_path / "modal").mkdir()
    random, lines = np.random.default_rng(1), ['schema = 1\ntitle = "Modal test"']
    for repeat in range(6):
        for number, frequency in enumerate(eigenfrequencies(0.05)):
            value = frequency * (1 + 2e-4 * random.standard_normal())
            lines.append(f"""[[mode]]
name = "{number} {repeat}"
configuration = "jointed"
frequency = "{value:.6f} Hz"
frequency_deviation = "{2e-4 * frequency:.6f} Hz"
{"held_out = true" if repeat > 3 else ""}""")
    (tmp_path / "modal" / "campaign.toml").write_text("\n".join(lines), encoding="utf-8")
    return tmp_path


def run(folder: Path, campaign: str, capfdbinary: pytest.CaptureFixture[bytes], *options: str) -> dict[str, Any]:
    words = ["diagnose", str(folder / "chain.toml"), str(folder / campaign), "--out", str(folder / "out"), "--json"]
    assert main([*words, *options]) == 0
    result: dict[str, Any] = json.loads(capfdbinary.readouterr().out)
    return result


def test_a_calibration_writes_the_fit_and_undo_takes_it_back(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    case, stiffer = folder / "chain.toml", 1.04
    case.write_text(f"{CASE}[accepted]\nE = 0.05\n", encoding="utf-8")
    drawn = case.read_text(encoding="utf-8")
    (folder / "stiffer").mkdir()
    modes = [
        f'[[mode]]\nname = "{number}"\nconfiguration = "jointed"\nfrequency = "{value * stiffer**0.5:.6f} Hz"\n'
        f'frequency_deviation = "{1e-4 * value:.6f} Hz"'
        for number, value in enumerate(eigenfrequencies(0.0))
    ]
    (folder / "stiffer" / "campaign.toml").write_text("\n".join(["schema = 1", *modes]), encoding="utf-8")
    assert main(["calibrate", str(case), str(folder / "stiffer"), "--json"]) == 0
    result = json.loads(capfdbinary.readouterr().out)
    # The stiffness is that of the modes; 1e-4 of a frequency are 2e-4 of a stiffness.
    assert float(result["calibrated"]["E"]) == pytest.approx(stiffer, abs=6e-4)
    assert f"E = {result['calibrated']['E']}" in case.read_text(encoding="utf-8")
    assert result["errors_after"]["training_chi2"] < 1 < 100 < result["errors_before"]["training_chi2"]
    assert result["errors_after"]["training"] is None
    assert main(["undo", "--case", str(case)]) == 0
    assert case.read_text(encoding="utf-8") == drawn


def test_a_hidden_mass_is_named_added_and_gone(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    result = run(folder, "modal", capfdbinary)
    assert result["finding"] == "missing"
    assert result["effects"] == ["mass at middle"]
    best = next(item for item in result["candidates"] if item["effect"] == "mass at middle")
    assert best["strength"] == pytest.approx(0.05, abs=4 * best["deviation"])
    html = (folder / "out" / "chain_diagnosis.html").read_text(encoding="utf-8")
    assert "mass at middle" in html
    assert "<title>Three masses: diagnosis</title>" in html
    assert "Held out: 0 4; 1 4; 2 4; 0 5; 1 5; 2 5." in html
    assert html.count(">held out</td>") == 6
    assert "<script src" not in html
    assert main(["add", "mass at middle", "--case", str(folder / "chain.toml")]) == 0
    # Features have no relative error: their deviations alone count.
    said = capfdbinary.readouterr().out.decode()
    assert "before  reduced chi-squared" in said
    assert "%" not in said.split("after")[0]
    text = (folder / "chain.toml").read_text(encoding="utf-8")
    assert 'effect = "mass at middle"' in text
    half = float(text.split('effect = "mass at middle"')[1].split("# +- ")[1].split()[0]) / 1e3  # g
    assert half == pytest.approx(1.96 * best["deviation"], rel=0.05)
    again = run(folder, "modal", capfdbinary)
    assert again["finding"] == "nothing"
    assert again["before"]["held_out_error"] < 0.2 * result["before"]["held_out_error"]


def test_a_diagnosis_is_of_the_case_as_it_was_when_it_began(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = folder / "chain.toml"

    def diagnose_and_edit(*given: Any, **options: Any) -> Any:
        case.write_text(CASE.replace("Three masses", "Edited meanwhile"), encoding="utf-8")
        return diagnose_features(*given, **options)

    monkeypatch.setattr(data_run, "diagnose_features", diagnose_and_edit)
    run(folder, "modal", capfdbinary)
    assert history_of(case).steps[-1].case_key == hash_case(CASE)


def test_auto_adds_what_is_missing(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    assert run(folder, "modal", capfdbinary, "--auto")["finding"] == "nothing"
    assert 'effect = "mass at middle"' in (folder / "chain.toml").read_text(encoding="utf-8")


def test_a_loop_with_play_is_unknown_and_says_play(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    x = 1e-3 * np.cos(np.linspace(0, 10 * np.pi, 5001))
    force, slider = np.empty(len(x)), 0.0
    for number, here in enumerate(x):
        gap = here - slider
        stretch = np.sign(gap) * max(abs(gap) - 1e-4, 0.0)
        force[number] = np.clip(1e6 * stretch, -200, 200)
        if abs(stretch) > 2e-4:
            slider = here - np.sign(gap) * 3e-4
    (folder / "bench").mkdir()
    table = "\n".join(f"{a:.9g},{b:.9g}" for a, b in zip(x, force, strict=True))
    (folder / "bench" / "loop.csv").write_text(f"x,f\n{table}\n", encoding="utf-8")
    (folder / "bench" / "campaign.toml").write_text(
        """schema = 1
title = "Bench"
[[loop]]
name = "1 mm"
file = "loop.csv"
place = "left"
frequency = "1 Hz"
[loop.columns]
displacement = { column = "x", unit = "m" }
force = { column = "f", unit = "N" }
""",
        encoding="utf-8",
    )
    result = run(folder, "bench", capfdbinary)
    assert result["finding"] == "unknown"
    assert "backlash" in result["verdict"]
    play = next(sign for sign in result["signs"] if sign["kind"] == "play")
    assert play["clear"]
    assert "0.2 mm" in play["measured"]


def test_the_bench_shows_such_data_names_the_effect_and_adds_it(folder: Path) -> None:
    bench = open_bench(folder / "chain.toml", folder / "modal", cache=folder / "cache")
    shown = bench.compare()
    assert shown.views["verdict"]["is_alone"]
    assert any(section["table"] for section in shown.views["data"])
    assert bench.screen().views["candidates"]["rows"] == []
    result = bench.diagnose().views["candidates"]
    assert result["verdict"]["finding"] == "missing"
    assert [row["name"] for row in result["rows"] if row["is_named"]] == ["mass at middle"]
    bench.add("mass at middle", seen=shown.views["verdict"]["seen"])
    now = bench.compare()
    # Noise alone makes 1, by as much as 54 numbers tell.
    assert (
        now.numbers["difference [standard deviations]"] < 1.5 < 10 < shown.numbers["difference [standard deviations]"]
    )


def test_a_parameter_that_is_moved_moves_what_is_predicted(folder: Path) -> None:
    text = (folder / "modal" / "campaign.toml").read_text(encoding="utf-8")
    measured, deviation = (
        np.array([float(value) for value in re.findall(rf'^{key} = "([\d.]+) Hz"', text, re.MULTILINE)])
        for key in ("frequency", "frequency_deviation")
    )
    bench, predicted = open_bench(folder / "chain.toml", folder / "modal"), np.tile(eigenfrequencies(0.0), 6)
    drawn = (folder / "chain.toml").read_text(encoding="utf-8")
    for modulus in (1.0, 1.02):
        answer = bench.move({"E": modulus})
        # All stiffness follows the modulus. The campaign states deviations to the last of five digits, and differences
        # to some ten of them: a thousandth is sure.
        size = np.sqrt(np.mean(((predicted * np.sqrt(modulus) - measured) / deviation) ** 2))
        assert answer.numbers["difference [standard deviations]"] == pytest.approx(size, rel=1e-3)
        assert answer.views["moved"]["values"] == {"E": modulus}
    assert answer.views["moved"]["data"] != bench.compare().views["data"]
    assert (folder / "chain.toml").read_text(encoding="utf-8") == drawn
    with pytest.raises(InputError, match="there are"):
        bench.move({"F": 1.0})


def test_in_python_data_have_a_function_of_their_own_which_the_other_one_names(folder: Path) -> None:
    campaign = read_campaign(folder / "modal")
    with pytest.raises(CampaignError, match=r"\(mode\).*diagnose_data"):
        diagnose_file(folder / "chain.toml", campaign, folder / "modal")
    result = data_run.diagnose_data(folder / "chain.toml", campaign, folder / "modal")
    assert result.diagnosis.verdict.sentence
