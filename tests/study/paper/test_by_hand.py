"""What a user's campaign has for the by-hand way, and what is said of what it lacks."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from study.cli import main
from study.estimate.resonance import MeasuredResonance
from study.paper.by_hand import list_missing
from study.paper.limits import MeasuredFamilies, find_peak, read_families, rename_by_line
from study.paper.linear import LinearCalibration
from study.shipped_cases import RIG

SENSORS = {
    "acc": 'quantity = "acceleration"\ndirection = "y"\nplace = "tip"',
    "cell A": 'quantity = "contact force"\nline = "left_decoupler"\ncomponent = "normal"',
    "cell B": 'quantity = "contact force"\nline = "left_decoupler"\ncomponent = "tangential"',
}
UNIT = {"acc": "m/s^2", "cell A": "N", "cell B": "N"}
FREQUENCY = np.linspace(250.0, 254.0, 9)


def measure(
    folder: Path, sensors: list[str], levels: list[float], repeats: int, harmonics: tuple[int, ...] = (0, 1)
) -> MeasuredFamilies:
    """Families of a campaign whose resonance is at 252 Hz; the forces are measured at every second frequency."""
    rows = ["test,order,repeat,sweep,level,frequency,sensor,harmonic,real,imag,unit"]
    for repeat in range(1, repeats + 1):
        for level in levels:
            for number, frequency in enumerate(FREQUENCY * (1 + 1e-5 * repeat)):
                size = level / np.hypot((number - 4) / 4, 0.2)
                for name in sensors:
                    for harmonic in (1,) if name == "acc" else harmonics:
                        if name == "acc" or number % 2 == 0:
                            value = size if harmonic else 20.0 + level
                            rows.append(
                                f"stepped,{repeat},{repeat},up,{level},{frequency},{name},{harmonic},{value},0.0,{UNIT[name]}"
                            )
    folder.mkdir(exist_ok=True)
    (folder / "stepped.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    tables = "\n".join(f'[[sensor]]\nname = "{name}"\n{SENSORS[name]}' for name in sensors)
    (folder / "campaign.toml").write_text(
        f'schema = 1\n[convention]\ntime = "exp(+i omega t)"\namplitude = "peak"\n[units]\nlevel = "N"\n'
        f'frequency = "Hz"\n{tables}\n[[test]]\nname = "stepped"\nconfiguration = "jointed"\nfile = "stepped.csv"\n',
        encoding="utf-8",
    )
    return read_families(rename_by_line(read_campaign(folder)))


def linear(free: bool) -> LinearCalibration:
    peak = MeasuredResonance(
        free=False, frequency=252.0, frequency_deviation=0.1, damping=2e-3, damping_deviation=1e-4, source="a test"
    )
    return LinearCalibration(free=peak if free else None, stuck=peak, iterations=())


def test_forces_are_named_by_their_line_and_read_at_the_peak_of_the_response(tmp_path: Path) -> None:
    measured = measure(tmp_path, list(SENSORS), [1.0, 3.0, 5.0, 10.0], 2)
    assert measured.sensor == "acc"
    assert {family.sensor for family in measured.forces} == {"left_decoupler_N", "left_decoupler_T"}
    assert [find_peak(family) for family in measured.response] == pytest.approx([252.0] * 4, rel=2e-5)
    static = next(item for item in measured.forces if (item.harmonic, item.level) == (0, 3.0))
    assert static.value.tolist() == [23.0, 23.0]
    assert list_missing(measured, linear(True)) == [
        "No static force of the right side was measured: its dead weight stays as the case has it."
    ]


def test_each_lack_of_a_campaign_is_one_sentence(tmp_path: Path) -> None:
    sentences = list_missing(measure(tmp_path, ["acc"], [1.0, 3.0, 10.0], 1), linear(False))
    for word in ("without dampers", "No contact forces", "3 levels (1, 3, 10 N)", "one repeat", "one curve"):
        assert sum(word in sentence for sentence in sentences) == 1
    assert len(sentences) == 5


def test_dynamic_forces_alone_tell_no_alignment(tmp_path: Path) -> None:
    measured = measure(tmp_path, list(SENSORS), [1.0, 3.0, 5.0, 10.0], 2, harmonics=(1,))
    (sentence,) = list_missing(measured, linear(True))
    assert "without their mean" in sentence


def test_a_campaign_without_a_response_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="sensor of motion"):
        measure(tmp_path, ["cell A"], [1.0], 1)


def test_a_case_that_is_no_rig_is_refused_with_the_command_that_fits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    beam = Path(RIG).parent / "beam" / "beam.toml"
    words = ["study", "calibrate", str(beam), str(tmp_path), "--out", str(tmp_path / "out"), "--cache", str(tmp_path)]
    assert main(words) != 0
    assert "--calibrate-families" in capsys.readouterr().err
