"""Diagnosis by features: what is missing is named, what is not there is not; indications count where nothing fits."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.data_type.indication import Indication
from correlation.data_type.mode import MeasuredMode
from correlation.model import Dof, Model, Sensor
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import EffectError
from diagnosis.decision.verdict import Finding
from diagnosis.feature.arrangement import FeatureArrangement, arrange_features
from diagnosis.feature.diagnose import FeatureResult, FeatureTest, diagnose_features, list_indications
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import JointedSystem, along

N, K = 3, 4e4
#: Relative deviations of frequencies and of damping.
ERROR = 2e-4, 0.02


def chain(*, mass: float = 0.0, modulus: float = 1.0) -> Model:
    """Three masses between walls; a further one at the second."""
    stiffness = modulus * K * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    weights = np.diag([1.0, 1.2 + mass, 0.7])
    system = JointedSystem(
        mass=weights, damping=1e-4 * stiffness, stiffness=stiffness, joints=[], static_load=np.zeros(N),
        harmonic_force=np.array([np.zeros(N), [1.0, 0, 0]]),
    )  # fmt: skip
    places = {name: along(N, {number: 1.0}) for number, name in enumerate("abc")}
    return Model(
        system=system, places=places, sensors=tuple(Sensor(name=name, row=row) for name, row in places.items()),
        dofs=tuple(Dof(body="chain", node=node, direction="x") for node in range(N)), n_harmonic=2,
    )  # fmt: skip


def measure(truth: Model, seed: int, n_repeat: int = 6) -> list[MeasuredMode]:
    """All modes, several times, with noise."""
    modes = compute_dense_modes(truth.system.mass, truth.system.stiffness)
    omega = np.sqrt(modes.lambda_)
    ratio = np.einsum("rk,rs,sk->k", modes.mode_shapes, truth.system.damping, modes.mode_shapes) / (2 * omega)
    random, result = np.random.default_rng(seed), []
    for repeat in range(n_repeat):
        for number in range(N):
            frequency, damping = omega[number] / (2 * np.pi), float(ratio[number])
            noise = random.standard_normal(2)
            result.append(
                MeasuredMode(
                    name=f"{repeat} {number}", configuration="jointed",
                    frequency=float(frequency * (1 + ERROR[0] * noise[0])), frequency_deviation=ERROR[0] * frequency,
                    damping=damping * (1 + ERROR[1] * noise[1]), damping_deviation=ERROR[1] * damping,
                    held_out=repeat >= n_repeat - 2,
                )
            )  # fmt: skip
    return result


def diagnose(truth: Model, seed: int) -> FeatureResult:
    model = chain()
    return diagnose_features(model, measure(truth, seed), list_calibration_parameters(model), without=["gain"])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_hidden_mass_is_named_by_its_modes(seed: int) -> None:
    result = diagnose(chain(mass=0.05), seed).diagnosis
    assert result.verdict.finding is Finding.MISSING
    (best,) = result.verdict.effects
    assert best.name == "mass at b"
    assert best.strength == pytest.approx(0.05, abs=4 * best.deviation)
    # The interval is small enough for that to mean something.
    assert best.deviation < 0.005


@pytest.mark.parametrize("seed", [3, 4])
def test_noise_alone_is_nothing(seed: int) -> None:
    result = diagnose(chain(), seed).diagnosis
    assert result.verdict.finding is Finding.NOTHING
    assert result.verdict.sentence.startswith("Nothing is missing")


def test_a_calibration_parameter_is_no_effect() -> None:
    result = diagnose(chain(modulus=1.02), 5).diagnosis
    assert result.verdict.finding is Finding.NOTHING
    assert result.baseline.fit.values[1] == pytest.approx(1.02, abs=2e-3)


def test_a_model_that_is_far_off_is_said_so() -> None:
    truth = chain(modulus=1.6)
    truth = truth.with_system(mass=truth.system.mass @ np.diag([1.0, 1.9, 0.6]))
    result = diagnose(truth, 6).diagnosis
    assert result.verdict.finding is Finding.NOT_CLOSE
    assert "resonance near" in result.verdict.sentence


def test_a_mode_that_varies_with_the_amplitude_is_missed_by_its_least_error() -> None:
    """A linear model at 37 Hz meets a mode of 36 to 39 Hz at one amplitude; another one it misses by 5 %."""
    measured, predicted = (
        np.array([36.0, 1e-3, 38.0, 39.0, 37.0, 100.0]),
        np.array([37.0, 1e-3, 37.0, 37.0, 37.0, 95.0]),
    )
    features: Any = SimpleNamespace(unit=("Hz", "-", "Hz", "Hz", "Hz", "Hz"))

    def find(count: int) -> tuple[float, float] | None:
        of: Any = SimpleNamespace(
            train=SimpleNamespace(features=[SimpleNamespace(unit=features.unit[:count])], measured=measured[:count])
        )
        fit: Any = SimpleNamespace(prediction=predicted[:count])
        return FeatureArrangement.find_worst_frequency(of, fit)

    assert find(5) == (37.0, 0.0)
    assert find(6) == (100.0, pytest.approx(-0.05))


def test_an_added_effect_has_the_bounds_of_the_data_and_no_value_beyond_them() -> None:
    """A fit would take a bound in its place, and say nothing."""
    model = chain()
    small, large = (list_effects(model, level=level).effect("cubic at b") for level in (1.0, 1e3))
    strong = AddedEffect(effect=large, values=np.array([0.9 * small.parameters[0].upper]))
    listed = strong.listed_in(list_effects(model, level=1.0))
    assert listed.effect.parameters == small.parameters
    with pytest.raises(EffectError, match=r'"cubic at b": stiffness = .* is outside the bounds of a fit to these data'):
        strong.listed_in(list_effects(model, level=1e3))


def test_every_third_datum_tests_where_none_is_held_out() -> None:
    modes = [MeasuredMode(**{**vars(item), "held_out": False}) for item in measure(chain(), 7)]
    model = chain()
    result = arrange_features(model, modes, list_calibration_parameters(model))
    names = [[item.name for item in side.data] for side in (result.train, result.held_out)]
    assert names[1] == [item.name for item in modes[1::3]]
    assert sorted(names[0] + names[1]) == sorted(item.name for item in modes)


def test_an_effect_that_leaves_a_sign_explains_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The held-out error falls enough, but the data still show what the model does not."""
    result = diagnose(chain(mass=0.05), 1)
    found = result.diagnosis

    def indication(difference: float) -> Indication:
        return Indication(quantity="mode", kind="frequency", measured="falls", predicted="stays", difference=difference)

    def explains(before: float, after: float) -> bool:
        monkeypatch.setattr("diagnosis.feature.diagnose.list_indications", lambda *_: (indication(after),))
        test = FeatureTest(baseline=found.baseline, floor=np.ones(1), data=(), indications=(indication(before),))
        return test.explains(found.refits[0])

    assert explains(-40.0, -15.0)
    assert not explains(-40.0, -30.0)
    # What was not clear need not be explained.
    assert explains(-3.0, -9.0)


def test_modes_have_no_indications() -> None:
    assert list_indications(chain(), measure(chain(), 1)) == ()
