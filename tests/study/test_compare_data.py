"""``stickslip compare`` of a campaign without steady states: modes and ring-downs beside a plain case."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Suspicion
from correlation.data_type.registry import Features
from study.cli import main
from study.compare.data import DataComparison, describe_data
from study.compare.data_run import summarise_data

CASE = """schema = 2
title = "Two masses"
[structure]
kind = "plain"
file = "chain.npz"
[[structure.dof]]
direction = "x"
[[structure.dof]]
direction = "x"
[[sensor]]
name = "a"
dof = 0
[accepted]
zeta = "20 %"
"""
#: 1.2 % stiffer than the case, and 1.25 times as damped.
MODES = """schema = 1
title = "Modal test"
[[mode]]
name = "lower"
configuration = "jointed"
frequency = "32.021 Hz"
damping = "1.2426 %"
damping_deviation = "0.01 %"
[[mode]]
name = "upper"
configuration = "jointed"
frequency = "55.462 Hz"
damping = "2.1522 %"
damping_deviation = "0.02 %"
held_out = true
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    np.savez(tmp_path / "chain.npz", M=np.eye(2), K=stiffness, C=1e-4 * stiffness)
    (tmp_path / "chain.toml").write_text(CASE, encoding="utf-8")
    (tmp_path / "modal").mkdir()
    (tmp_path / "modal" / "campaign.toml").write_text(MODES, encoding="utf-8")
    return tmp_path


def run(folder: Path, capfdbinary: pytest.CaptureFixture[bytes], *options: str) -> dict[str, object]:
    words = ["compare", str(folder / "chain.toml"), str(folder / "modal"), "--out", str(folder / "out"), "--json"]
    assert main([*words, *options]) == 0
    result: dict[str, object] = json.loads(capfdbinary.readouterr().out)
    return result


def test_numbers_stand_beside_those_of_the_model(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    result = run(folder, capfdbinary)
    lower, upper = result["data"]  # type: ignore[misc]
    # Chain of two: sqrt(4e4) and sqrt(12e4) rad/s.
    assert lower["numbers"][0]["predicted"] == pytest.approx(200 / (2 * np.pi))
    assert upper["numbers"][0]["predicted"] == pytest.approx(200 * np.sqrt(3) / (2 * np.pi))
    assert upper["held_out"]
    with (folder / "out" / "chain_compare_data.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["quantity"] for row in rows] == ["frequency", "damping ratio"] * 2
    html = (folder / "out" / "chain_compare.html").read_text(encoding="utf-8")
    assert "32.021" in html
    assert "<script src" not in html
    assert '<link rel="stylesheet' not in html


def test_calibration_parameters_are_fitted_to_the_training_data(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    result = run(folder, capfdbinary, "--calibrate")
    calibrated = result["calibrated"]
    assert calibrated["E"]["factor"] == pytest.approx(1.012, abs=2e-3)  # type: ignore[index]
    assert calibrated["zeta"]["factor"] == pytest.approx(1.25, abs=0.02)  # type: ignore[index]
    upper = result["data"][1]  # type: ignore[index]
    # The held-out mode is predicted by the calibrated model.
    assert upper["root_mean_square_error"] < 2


def test_a_calibration_is_not_announced_with_the_time_of_a_comparison(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    words = ["compare", str(folder / "chain.toml"), str(folder / "modal"), "--out", str(folder / "out")]
    assert main(words) == 0
    assert b"comparison ... about 5.0 s" in capfdbinary.readouterr().err
    assert main([*words, "--calibrate"]) == 0
    assert b"comparison ... about" not in capfdbinary.readouterr().err


@pytest.mark.parametrize("option", ["--limits", "--calibrate-families"])
def test_families_need_steady_states(folder: Path, capfdbinary: pytest.CaptureFixture[bytes], option: str) -> None:
    words = ["compare", str(folder / "chain.toml"), str(folder / "modal"), "--out", str(folder / "out"), option]
    assert main(words) == 0
    assert option.encode() in capfdbinary.readouterr().err


def test_time_records_alone_are_sent_to_their_page(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    manifest = 'schema = 1\n[[sensor]]\nname = "a"\nquantity = "displacement"\ndirection = "x"\nplace = "p"\n'
    manifest += '[[record]]\nname = "r"\nfile = "r.csv"\nunits = { a = "m" }\n'
    (folder / "modal" / "campaign.toml").write_text(manifest, encoding="utf-8")
    (folder / "modal" / "r.csv").write_text("time,a\n0,1\n1,2\n", encoding="utf-8")
    assert main(["compare", str(folder / "chain.toml"), str(folder / "modal"), "--out", str(folder / "out")]) == 2
    assert b"docs/time_records.md" in capfdbinary.readouterr().err


def datum(value: float, predicted: float) -> DataComparison:
    features = Features(label=("damping ratio",), unit=("-",), value=np.array([value]), deviation=np.array([1e-4]))
    return DataComparison(
        name="t1", type="frequency response", held_out=False, features=features, predicted=np.array([predicted])
    )


def test_a_number_that_is_not_clear_of_zero_has_no_relative_error() -> None:
    assert "%" not in describe_data([datum(2.9e-26, 0.013)])[1]
    assert "(+30.00%)" in describe_data([datum(0.01, 0.013)])[1]


def test_the_headline_names_data_without_a_comparison() -> None:
    summary = summarise_data([datum(0.01, 0.01), datum(0.01, np.nan)])
    assert summary.tone == "ambiguous"
    assert "not frequency response t1" in summary.tag
    assert summarise_data([datum(0.01, 0.01)]).tone == "nothing"


def test_a_headline_does_not_agree_with_data_that_look_wrong() -> None:
    dead, rounded = (Suspicion(where='hammer, "a"', sentence="", remark=remark) for remark in (False, True))
    for value, tone in ((0.01, "ambiguous"), (0.02, "missing")):
        summary = summarise_data([datum(0.01, value)], [dead, rounded])
        assert summary.tone == tone
        assert summary.tag.endswith('look wrong: hammer, "a"')
    assert summarise_data([datum(0.01, 0.01)], [rounded]).tone == "nothing"


def test_both_commands_suspect_modes_of_swapped_sensors(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    """Shapes of the chain are (1, 1) and (1, -1): the sign of one sensor turns one into the other."""
    (folder / "chain.toml").write_text(f'{CASE}[[sensor]]\nname = "b"\ndof = 1\n', encoding="utf-8")
    sensors = "".join(
        f'[[sensor]]\nname = "{name}"\nquantity = "displacement"\ndirection = "x"\nplace = "{name}"\n' for name in "ab"
    )
    lower, upper = MODES.split("[[mode]]")[1:]
    modes = f"[[mode]]{lower}shape = {{ a = 1.0, b = -1.0 }}\n[[mode]]{upper}shape = {{ a = 1.0, b = 1.0 }}\n"
    (folder / "modal" / "campaign.toml").write_text(f"schema = 1\n{sensors}{modes}", encoding="utf-8")
    compared = run(folder, capfdbinary)
    words = ["diagnose", str(folder / "chain.toml"), str(folder / "modal"), "--out", str(folder / "out"), "--json"]
    assert main(words) == 0
    diagnosed = json.loads(capfdbinary.readouterr().out)
    assert compared["suspicions"] == diagnosed["suspicions"]
    assert "mounted the other way round" in compared["suspicions"][0]  # type: ignore[index]
    assert "look wrong" in compared["summary"][0]  # type: ignore[index]
    assert "other way round" in (folder / "out" / "chain_diagnosis.html").read_text(encoding="utf-8")
