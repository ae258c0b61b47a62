"""Measured records of an electronic oscillator with a hardening spring: the Silverbox, all in volts.

STICKSLIP_DATA names a folder with `silverbox/SNLS80mV.csv` (docs/time_records.md says where it comes from).
"""

import os
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.time_record import TimeRecord
from correlation.time_record.prediction import estimate_numerical_error
from correlation.time_record.single_dof import fit_single_dof
from diagnosis.decision.verdict import Finding
from diagnosis.effect.density import Density
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.time_record.arrangement import about_mean, stretch
from diagnosis.time_record.diagnose import RecordDiagnosis, record_rounds

FILE = Path(os.environ.get("STICKSLIP_DATA", "")) / "silverbox" / "SNLS80mV.csv"
RATE = 1e7 / 2**14  # Hz


#: Samples: the arrow, then the first of ten multisines of 8,692 samples each, between quiet stretches.
ARROW, FIRST, PERIOD, LAST = (0, 40495), 40550, 8692, 8650


@pytest.fixture(scope="module")
def whole() -> TimeRecord:
    if "STICKSLIP_DATA" not in os.environ:
        pytest.skip("STICKSLIP_DATA is not set: it names the folder that holds silverbox/SNLS80mV.csv")
    if not FILE.is_file():
        pytest.skip(f"{FILE} is not there")
    values = np.loadtxt(FILE, delimiter=",", skiprows=1, usecols=(0, 1)).T
    record = TimeRecord(
        name="SNLS80mV", time=np.arange(values.shape[1]) / RATE, channels=("V1", "V2"), units=("V", "V"),
        values=values, force="V1",
    )  # fmt: skip
    return about_mean(record)


def diagnosed(whole: TimeRecord, train: int, held: int, most: int = 3) -> list[RecordDiagnosis]:
    """Train on one multisine, hold out another and the arrow."""
    records = [
        stretch(whole, begin, begin + LAST, name=f"multisine {number}", held_out=number == held)
        for number in (train, held)
        for begin in (FIRST + (number - 1) * PERIOD,)
    ]
    records.append(stretch(whole, *ARROW, name="arrow", held_out=True))
    base = fit_single_dof(records[0], "V2")
    # Mass, damping and stiffness of one degree of freedom in volts: three factors.
    fitted = [*list_calibration_parameters(base), Density(name="density of all", part="all")]
    return record_rounds(base, records, fitted, run_in=0.5, units={"N": "V", "m": "V"}, most=most)


@pytest.fixture(scope="module")
def rounds(whole: TimeRecord) -> list[RecordDiagnosis]:
    return diagnosed(whole, train=1, held=3)


def test_a_cubic_spring_comes_first(rounds: list[RecordDiagnosis]) -> None:
    first = rounds[0]
    assert first.scores[0].effect.kind == "cubic"
    assert first.verdict.finding is Finding.MISSING
    best = first.verdict.effects[0]
    assert best.effect is not None
    assert best.effect.kind == "cubic"
    # Its interval is about half a per cent.
    assert best.strength > 100 * best.deviation
    assert "V/V^3" in first.verdict.sentence


def test_the_held_out_error_falls_at_least_five_times(rounds: list[RecordDiagnosis]) -> None:
    before, after = rounds[0].baseline, rounds[0].verdict.effects[0]
    # In the other multisine, and in the arrow, which goes beyond the amplitudes of the training.
    assert (after.held_out_errors < before.held_out_errors / 5).all()
    # Measured 0.59 and 0.79 %: a simulation, no prediction from the last sample.
    assert (after.held_out_errors < 0.01).all()


def test_other_effects_hardly_help(rounds: list[RecordDiagnosis]) -> None:
    others = [item for item in rounds[0].scores if item.effect.kind != "cubic"]
    assert {item.effect.kind for item in others} >= {"air damping", "spring", "mass", "gain", "dashpot"}
    # Shares of the squared error.
    chi2 = rounds[0].arrangement.fit.chi2
    assert max(item.gain / chi2 for item in others) < 0.05


def test_another_training_finds_the_same_spring(whole: TimeRecord, rounds: list[RecordDiagnosis]) -> None:
    one, other = rounds[0].verdict.effects[0], diagnosed(whole, train=4, held=8, most=1)[0].verdict.effects[0]
    # Records without a sample in common: four standard deviations of the difference.
    assert abs(one.strength - other.strength) < 4 * np.hypot(one.deviation, other.deviation)


def test_nothing_further_passes_the_gate(rounds: list[RecordDiagnosis]) -> None:
    assert len(rounds) == 2
    last = rounds[1]
    assert last.verdict.finding is Finding.NOTHING
    # The best of the rest, drag, takes 18 % of the error off: just less than the test asks for.
    assert last.refits[0].effect is not None
    assert last.refits[0].effect.kind == "air damping"
    assert last.refits[0].held_out_error > 0.8 * last.baseline.held_out_error


def test_the_numerical_error_is_far_below_what_is_left(rounds: list[RecordDiagnosis]) -> None:
    arrangement = rounds[1].arrangement
    error = estimate_numerical_error(arrangement.fit.model, arrangement.train.drives[0])
    assert error < 0.1 * rounds[1].baseline.held_out_error
