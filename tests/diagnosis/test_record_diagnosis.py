"""What time records say of a model: hidden effects found and measured, nothing claimed where nothing is.

The records are made here, by an explicit Runge-Kutta method of order 8, with coloured noise; stiffness, damping and a
sensor's gain are off in the model that is given.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import Dof, Model, Sensor
from diagnosis.candidate.effect import Effect
from diagnosis.decision.verdict import Finding
from diagnosis.effect.gain import Gain
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.time_record.arrangement import arrange_records, stretch
from diagnosis.time_record.diagnose import RecordDiagnosis, diagnose_records, record_rounds
from diagnosis.time_record.held_out import rename_unit
from reduction.jointed_system import JointedSystem, along
from tests.slow import slow

M = np.diag([1.0, 0.5])
K = np.array([[5e4, -2e4], [-2e4, 2e4]])  # resonances at 20.3 and 43.2 Hz
C = 2e-4 * K  # damping ratios of 1.3 and 2.7 %
TRUE_E, TRUE_ZETA, TRUE_GAIN = 1.02, 0.9, 1.015
RATE, N_SAMPLE = 256.0, 1200
NOISE = 0.01  # of each channel's root mean square
#: What each structure hides: cubic stiffness at the tip, drag at the exciter, mass at the tip.
HIDDEN = {"nothing": (0.0, 0.0, 0.0), "cubic": (4e7, 0.0, 0.0), "air": (0.0, 25.0, 0.0), "mass": (0.0, 0.0, 0.02)}
EXCITER, TIP = along(2, {0: 1.0}), along(2, {1: 1.0})


def base() -> Model:
    system = JointedSystem(mass=M, damping=C, stiffness=K, harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]))
    return Model(
        system=system,
        sensors=(Sensor(name="tip", row=TIP), Sensor(name="shock", row=EXCITER, quantity="acceleration")),
        dofs=(Dof(node=0, direction="z"), Dof(node=1, direction="z")),
        places={"exciter": EXCITER, "tip": TIP},
    )


def fitted(model: Model) -> list[Effect]:
    return [*list_calibration_parameters(model), Gain(name="gain of tip", sensor="tip")]


def force(t: NDArray[np.float64] | float, seed: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    frequency = np.arange(4.0, 64.0, 2.0) + rng.uniform(-0.5, 0.5, 30)
    phase = rng.uniform(0, 2 * np.pi, 30)
    return np.asarray(1.5 * np.sin(2 * np.pi * np.multiply.outer(np.asarray(t), frequency) + phase).sum(-1))


@pytest.fixture(scope="module")
def records() -> dict[str, list[TimeRecord]]:
    """One to train on and one held out of each structure, from rest; all integrated at once."""
    cubic, drag, mass = np.array(list(HIDDEN.values())).T
    inverse = np.linalg.inv(M + mass[:, None, None] * np.outer(TIP, TIP))
    shape, time = (2, len(HIDDEN), 2), np.arange(N_SAMPLE) / RATE
    made: dict[str, list[TimeRecord]] = {name: [] for name in HIDDEN}
    rng = np.random.default_rng(5)

    for seed in (1, 2):

        def rates(t: float, flat: NDArray[np.float64], seed: int = seed) -> NDArray[np.float64]:
            q, v = flat.reshape(shape)
            f = -TRUE_ZETA * v @ C - TRUE_E * q @ K
            f[:, 0] += force(t, seed) - drag * np.abs(v[:, 0]) * v[:, 0]
            f[:, 1] -= cubic * q[:, 1] ** 3
            return np.stack([v, np.einsum("cij,cj->ci", inverse, f)]).ravel()

        result = solve_ivp(rates, (0, time[-1]), np.zeros(np.prod(shape)), "DOP853", time, rtol=1e-8, atol=1e-12)
        slopes = np.stack([rates(t, x) for t, x in zip(time, result.y.T, strict=True)]).reshape(-1, *shape)
        for number, name in enumerate(HIDDEN):
            values = np.stack([TRUE_GAIN * result.y.T.reshape(-1, *shape)[:, 0, number, 1], slopes[:, 1, number, 0]])
            coloured = lfilter([1.0], [1.0, -0.8], rng.normal(size=values.shape))
            coloured *= NOISE * values.std(axis=1, keepdims=True) / coloured.std(axis=1, keepdims=True)
            run = TimeRecord(
                name=f"run {seed}", time=time, channels=("force", "tip", "shock"), units=("N", "m", "m/s^2"),
                values=np.vstack([force(time, seed), values + coloured]), force="force", held_out=seed == 2,
            )  # fmt: skip
            made[name].append(run)
    return made


def diagnosed(records: list[TimeRecord], **more: object) -> RecordDiagnosis:
    return diagnose_records(base(), records, fitted(base()), run_in=0.5, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("hidden", "name", "strength"),
    [
        ("cubic", "cubic at tip", 4e7),
        pytest.param("air", "air damping at exciter", 25.0, marks=slow),
        pytest.param("mass", "mass at tip", 0.02, marks=slow),
    ],
)
def test_the_hidden_effect_is_named_and_measured(
    records: dict[str, list[TimeRecord]], hidden: str, name: str, strength: float
) -> None:
    result, *rest = record_rounds(base(), records[hidden], fitted(base()), run_in=0.5, most=2)
    verdict = result.verdict
    assert verdict.finding is Finding.MISSING, verdict.sentence
    best = verdict.effects[0]
    assert best.effect is not None
    assert best.effect.name == name
    assert verdict.sentence.startswith(name[0].upper() + name[1:])
    # Noise of 1 % leaves about this; the interval must hold the truth as well, with room for one case in a thousand.
    assert best.strength == pytest.approx(strength, rel=0.04)
    assert abs(best.strength - strength) < 3.3 * best.deviation
    # Down to the noise: of two channels with 1 % each.
    assert best.held_out_error == pytest.approx(NOISE, rel=0.15)
    # What was fitted with it is right as well, and nothing is left.
    np.testing.assert_allclose(best.fit.values[:3], [TRUE_ZETA, TRUE_E, TRUE_GAIN], rtol=0.02)
    assert rest[0].verdict.finding is Finding.NOTHING, rest[0].verdict.sentence
    assert [item.effect.name for item in rest[0].arrangement.added] == [name]


def test_nothing_is_claimed_where_nothing_is_missing(records: dict[str, list[TimeRecord]]) -> None:
    result = diagnosed(records["nothing"])
    assert result.verdict.finding is Finding.NOTHING
    assert result.baseline.held_out_error == pytest.approx(NOISE, rel=0.15)
    assert "No effect lowers the held-out error enough" in result.verdict.sentence
    np.testing.assert_allclose(result.baseline.fit.values, [TRUE_ZETA, TRUE_E, TRUE_GAIN], rtol=0.02)


def test_deviations_hold_the_truth_though_the_noise_is_coloured(records: dict[str, list[TimeRecord]]) -> None:
    fit = diagnosed(records["nothing"]).baseline.fit
    away = np.abs(fit.values - [TRUE_ZETA, TRUE_E, TRUE_GAIN]) / fit.deviation
    assert away.max() < 4.0
    assert fit.deviation.max() < 0.02


def test_an_effect_outside_the_catalogue_is_not_called_by_another_name(records: dict[str, list[TimeRecord]]) -> None:
    # A linear spring stands in for the cubic one at a single level; knowing the noise shows that it does not explain.
    noise = {name: NOISE * float(records["cubic"][0].channel(name).std()) for name in ("tip", "shock")}
    result = diagnosed(records["cubic"], without=["cubic"], noise=noise)
    assert result.verdict.finding is Finding.UNKNOWN, result.verdict.sentence
    assert "none of the known effects" in result.verdict.sentence
    assert re.search(r"the noise is 1\.?\d? %", result.verdict.sentence)
    # It is no matter of the noise that the right one is found.
    assert diagnosed(records["cubic"], noise=noise).verdict.finding is Finding.MISSING


def test_the_size_of_an_effect_is_the_error_that_it_makes(records: dict[str, list[TimeRecord]]) -> None:
    result = diagnosed(records["mass"])
    score = result.scores[0]
    assert score.effect.name == "mass at tip"
    made = np.sqrt(result.baseline.error**2 - result.refits[0].error ** 2)
    # Linear in the strength, but for the shift of the resonance.
    by_strength = 0.02 / score.detectable / np.sqrt(result.arrangement.fit.n_number)
    assert by_strength == pytest.approx(made, rel=0.1)


def test_units_of_a_model_in_volts_are_told(records: dict[str, list[TimeRecord]]) -> None:
    verdict = diagnosed(records["cubic"], units={"N": "V", "m": "V"}).verdict
    assert " V/V^3 +- " in verdict.sentence
    volts = {"N": "V", "m": "V"}
    assert rename_unit("kg", volts) == "V s^2/V"
    assert rename_unit("N s/m", volts) == "V s/V"
    assert rename_unit("-", volts) == "-"


def test_records_that_no_fit_can_use_are_refused(records: dict[str, list[TimeRecord]]) -> None:
    train, held = records["nothing"]
    with pytest.raises(CampaignError, match="all 1 records are for training"):
        diagnosed([train])
    with pytest.raises(CampaignError, match="all 1 records are held out"):
        diagnosed([held])
    with pytest.raises(CampaignError, match='noise is given for "root"'):
        diagnosed([train, held], noise={"root": 1.0})
    with pytest.raises(CampaignError, match="samples 0 to 1199: 1000 to 1299"):
        stretch(train, 1000, 1300, name="late", held_out=True)
    flat = replace(train, values=np.vstack([train.values[:2], np.ones((1, N_SAMPLE))]))
    with pytest.raises(CampaignError, match='"shock" never changes'):
        diagnosed([flat, held])
    short = stretch(train, 0, 19, name="short", held_out=False)
    with pytest.raises(CampaignError, match='record "short": 19 samples after the run-in are too few'):
        diagnose_records(base(), [short, held], fitted(base()))
    soft = base().with_system(stiffness=-K)
    with pytest.raises(CampaignError, match="diverges at the start of the fit, with the values zeta 1"):
        arrange_records(soft, [train, held], fitted(base()))
