"""One degree of freedom: a start from a record alone, ring-downs by their closed form, what factors absorb."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from correlation.time_record.prediction import predict_record, prepare_drive
from correlation.time_record.single_dof import fit_single_dof
from diagnosis.decision.verdict import Finding
from diagnosis.effect.gain import Gain
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.time_record.arrangement import about_mean, arrange_records
from diagnosis.time_record.diagnose import diagnose_records
from reduction.jointed_system import JointedSystem
from tests.slow import slow

MASS, DAMPING, STIFFNESS = 5e-6, 2e-4, 0.98  # 70.5 Hz, a damping ratio of 4.5 %
RATE = 600.0


def oscillator() -> Model:
    system = JointedSystem(mass=[[MASS]], damping=[[DAMPING]], stiffness=[[STIFFNESS]], harmonic_force=[[0.0], [1.0]])
    return Model(system=system, sensors=(Sensor(name="y", row=np.ones(1)),), places={"mass": np.ones(1)})


def driven(seed: int, mass: float = MASS) -> TimeRecord:
    """A multisine, and what the oscillator answers in steady state: exact."""
    rng = np.random.default_rng(seed)
    omega, phase = 2 * np.pi * np.arange(5.0, 200.0, 3.0), rng.uniform(0, 2 * np.pi, 65)
    time = np.arange(2000) / RATE
    wave = 0.01 * np.exp(1j * (np.multiply.outer(time, omega) + phase))
    answer = wave / (STIFFNESS + 1j * omega * DAMPING - omega**2 * mass)
    return TimeRecord(
        name=f"seed {seed}", time=time, channels=("u", "y"), units=("V", "V"),
        values=np.stack([wave.sum(1).real, answer.sum(1).real]), force="u", held_out=seed == 2,
    )  # fmt: skip


def ring_down(amplitude: float, phase: float, *, held_out: bool) -> TimeRecord:
    time = np.arange(600) / RATE
    decay = DAMPING / (2 * MASS)
    values = amplitude * np.exp(-decay * time) * np.cos(np.sqrt(STIFFNESS / MASS - decay**2) * time + phase)
    return TimeRecord(
        name=f"from {phase}", time=time, channels=("y",), units=("V",), values=values[None], held_out=held_out
    )


def matrices(model: Model) -> NDArray[np.float64]:
    return np.array([getattr(model.system, name)[0, 0] for name in ("mass", "damping", "stiffness")])


def test_an_oscillator_is_read_from_a_record() -> None:
    # Hann's window leaks, and spectra between the lines of a multisine are its shape alone: a start, no more.
    result = fit_single_dof(driven(1), "y")
    np.testing.assert_allclose(matrices(result), [MASS, DAMPING, STIFFNESS], rtol=0.02)


def test_a_sensor_that_reads_the_other_way_turns_the_force() -> None:
    run = driven(1)
    turned = replace(run, values=run.values * np.array([[1.0], [-1.0]]))
    result = fit_single_dof(turned, "y")
    assert result.system.dynamic[1, 0] == -1.0
    prediction = predict_record(result, prepare_drive(turned, run_in=0.5))
    assert prediction is not None
    assert np.corrcoef(prediction[0], prepare_drive(turned, run_in=0.5).measured[0])[0, 1] > 0.99


def test_a_fit_finds_the_oscillator_exactly() -> None:
    base = oscillator().with_system(damping=[[1.3 * DAMPING]], stiffness=[[1.05 * STIFFNESS]])
    result = arrange_records(base, [driven(1), driven(2)], list_calibration_parameters(base), run_in=1.0).fit
    # The integration: 8 steps per sample are right to 1e-4 here.
    np.testing.assert_allclose(matrices(result.model), [MASS, DAMPING, STIFFNESS], rtol=5e-4)


@slow
def test_a_fit_to_a_ring_down_finds_its_start_as_well() -> None:
    base = oscillator().with_system(damping=[[1.3 * DAMPING]], stiffness=[[0.97 * STIFFNESS]])
    runs = [ring_down(0.1, 0.3, held_out=False), ring_down(0.05, -1.0, held_out=False)]
    runs.append(ring_down(0.2, 2.0, held_out=True))
    result = diagnose_records(base, runs, list_calibration_parameters(base))
    # Without a force the integration is exact: the fit ends when it gains no more than 1e-7 of the squared error.
    np.testing.assert_allclose(matrices(result.baseline.fit.model), [MASS, DAMPING, STIFFNESS], rtol=1e-6)
    # Each has a start of its own, the held-out one as well.
    assert result.baseline.held_out_error < 1e-5
    starts = result.baseline.fit.starts[::2] / np.sqrt(MASS)  # of the modal displacements, alternating with velocities
    np.testing.assert_allclose(starts, [0.1 * np.cos(0.3), 0.05 * np.cos(-1.0)], rtol=1e-5)


def test_three_factors_absorb_all_that_is_linear() -> None:
    base = oscillator()
    noisy = [
        replace(item, values=item.values + 1e-3 * np.random.default_rng(9).normal(size=item.values.shape))
        for item in (driven(1), driven(2))
    ]
    result = diagnose_records(
        base, noisy, [*list_calibration_parameters(base), Gain(name="gain of y", sensor="y")], run_in=1.0
    )
    absorbed = {item.effect.kind for item in result.scores if item.absorbed > 0.9999}
    # A record is not turned in phase, so that a delay does nothing there.
    assert absorbed == {"spring", "mass", "density", "dashpot", "delay"}
    assert all(item.gain == 0 for item in result.scores if item.effect.kind in absorbed)
    assert result.verdict.finding is Finding.NOTHING


def test_the_offset_of_a_force_is_taken_off() -> None:
    run = driven(1)
    shifted = replace(run, values=run.values + 0.5)
    assert about_mean(shifted).channel("u").mean() == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_array_equal(about_mean(shifted).channel("y"), shifted.channel("y"))
    silent = ring_down(0.1, 0.3, held_out=False)
    assert about_mean(silent) is silent


def test_what_is_no_oscillator_is_refused() -> None:
    with pytest.raises(CampaignError, match="has no force"):
        fit_single_dof(ring_down(0.1, 0.0, held_out=False), "y")
    # Its response falls with the frequency, and there is no resonance.
    with pytest.raises(CampaignError, match='"y" does not follow "u" like an oscillator'):
        fit_single_dof(driven(1, mass=-MASS), "y")
