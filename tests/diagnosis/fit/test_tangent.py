"""Rates of a model's data: closed forms come back exactly, and the response follows them."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.place import with_cubic_spring
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.jitter import FrequencyShift
from diagnosis.fit.tangent import differentiate
from hbsolve.errors import ModelError
from reduction.jointed_system import JenkinsChain, along

WIDE = (-10.0, 10.0)
#: Differences of what is linear: round-off over a step of 1e-4.
EXACT = 1e-9


def at(compose, *values: float, bounds: tuple[float, float] = WIDE):
    return differentiate(compose, np.array(values), np.ones(len(values)), [bounds] * len(values))


def test_accepted_parameters_scale_what_they_name(small: Model) -> None:
    unknowns = Unknowns.from_effects(small, [(item, item.deviation) for item in list_calibration_parameters(small)], ())
    result = dict(
        zip(
            unknowns.names,
            differentiate(unknowns.compose, unknowns.vanishing, unknowns.size, unknowns.bounds),
            strict=True,
        )
    )
    system = small.system
    assert set(result) == {"kt", "kn", "mu", "zeta", "E"}
    np.testing.assert_allclose(result["zeta"].jointed.matrices.damping, system.damping, rtol=EXACT)
    np.testing.assert_allclose(result["zeta"].free.matrices.damping, system.damping, rtol=EXACT)
    np.testing.assert_allclose(result["E"].free.matrices.stiffness, system.stiffness, rtol=EXACT)
    for name, field, value in (
        ("kt", "tangential_stiffness", 5e3),
        ("kn", "normal_stiffness", 1e4),
        ("mu", "friction_coefficient", 0.4),
    ):
        rates = result[name].jointed.joints
        assert rates == {(joint.name, field): pytest.approx(value, rel=EXACT) for joint in system.joints}
        assert not result[name].free.joints
        assert result[name].free.matrices.mass is None


def test_loads_and_gains(small: Model) -> None:
    row = along(small.system.n_dof, {0: 2.0})
    (static,) = at(lambda v: small.with_system(static_load=small.system.static + v[0] * row), 0.0)
    np.testing.assert_allclose(static.jointed.static_load, row, atol=EXACT)
    assert static.free.static_load is None
    (harmonic,) = at(
        lambda v: small.with_system(harmonic_force=small.system.dynamic + v[0] * np.array([[0.0] * 4, row])), 0.0
    )
    np.testing.assert_allclose(harmonic.free.harmonic_force[1], row, atol=EXACT)
    (gain,) = at(lambda v: small.with_sensor("root", gain=1.02 + 3 * v[0]), 0.0)
    assert gain.gain == {"root": pytest.approx(3.0, rel=EXACT)}


def test_more_harmonics_with_a_parameter_are_rates_too(small: Model) -> None:
    def compose(values):
        force = np.zeros((3, 4))
        force[1, 2] = 1.0
        force[2, 0] = values[0]
        return small.with_system(harmonic_force=force)

    (result,) = at(compose, 0.0)
    assert result.jointed.harmonic_force[2, 0] == pytest.approx(1.0, rel=EXACT)
    assert result.jointed.harmonic_force[1, 2] == 0


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_a_shift_of_one_test_acts_there_alone(small: Model, offset: float) -> None:
    (result,) = at(lambda v: FrequencyShift(configuration="free").apply(small, v), offset)
    # Omega (1 + e): a relative rate of 1 / (1 + e), squared with the mass; central differences of it.
    rate = 1 / (1 + offset)
    np.testing.assert_allclose(result.free.matrices.mass, 2 * rate * small.system.mass, rtol=1e-7)
    np.testing.assert_allclose(result.free.matrices.damping, rate * small.system.damping, rtol=1e-7)
    assert result.free.matrices.stiffness is None
    assert result.jointed.matrices.mass is None
    assert result.frequency_shift == {"free": pytest.approx(rate, rel=1e-7)}


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_a_bound_is_never_passed(small: Model, value: float) -> None:
    seen = []

    def compose(values):
        seen.append(float(values[0]))
        return small.with_system(mass=small.system.mass * (1 + values[0]))

    (result,) = at(compose, value, bounds=(0.0, 1.0))
    assert min(seen) >= 0
    assert max(seen) <= 1
    np.testing.assert_allclose(result.jointed.matrices.mass, small.system.mass, rtol=EXACT)


def test_a_value_that_the_model_does_not_take_makes_a_difference_one_sided(small: Model) -> None:
    def compose(values, most=0.5):
        if values[0] > most:
            raise ModelError("a joint takes no more")
        return small.with_system(mass=small.system.mass * (1 + values[0]))

    (result,) = at(compose, 0.5)
    np.testing.assert_allclose(result.jointed.matrices.mass, small.system.mass, rtol=EXACT)
    with pytest.raises(ModelError, match="no neighbouring value"):
        at(lambda values: compose(values) if values[0] == 0.5 else compose([1.0]), 0.5)


def test_the_first_parameter_wanted(small: Model) -> None:
    def compose(values):
        return small.with_system(
            mass=(1 + values[0]) * small.system.mass, damping=(1 + values[1]) * small.system.damping
        )

    result = differentiate(compose, np.zeros(2), np.ones(2), [WIDE] * 2, first=1)
    assert len(result) == 1
    assert result[0].jointed.matrices.mass is None


def test_a_joint_that_appears_is_refused(small: Model) -> None:
    with pytest.raises(EffectError, match="the joints change from"):
        at(lambda v: small if v[0] < 0 else with_cubic_spring(small, "more", along(4, {2: 1.0}), 1.0), 0.0)


@pytest.mark.parametrize("direction", ["normal", "tangents"])
def test_a_number_that_moves_or_turns_a_joint_has_no_rates(small: Model, direction: str) -> None:
    first, *rest = small.system.joints

    def compose(values):
        turned = replace(first, **{direction: getattr(first, direction) * (1 + values[0])})
        return small.with_system(joints=[turned, *rest], mass=(1 + values[1]) * small.system.mass)

    turns, scales = at(compose, 0.0, 0.0)
    assert turns is None
    # The other number moves nothing, and has its rates.
    np.testing.assert_allclose(scales.jointed.matrices.mass, small.system.mass, rtol=EXACT)


def test_young_s_modulus_is_complex_where_there_is_structural_damping(small: Model) -> None:
    lossy = small.with_system(structural_damping=0.02 * small.system.stiffness)
    (factor,) = [item for item in list_calibration_parameters(lossy) if item.name == "E"]
    (tangent,) = at(lambda v: factor.apply(lossy, [1 + v[0]]), 0.0, bounds=(-0.5, 0.5))
    np.testing.assert_allclose(tangent.free.matrices.structural_damping, 0.02 * small.system.stiffness, rtol=EXACT)
    np.testing.assert_allclose(tangent.free.matrices.stiffness, small.system.stiffness, rtol=EXACT)


def test_each_number_of_a_list_has_a_rate(small: Model) -> None:
    def chained(values: np.ndarray) -> Model:
        chain = JenkinsChain(
            name="chain", direction=along(4, {0: 1.0}), tangential_stiffness=(1e3, 2e3),
            limit_force=(1.0, 2.0 + float(values[0])), stiffness=0.0,
        )  # fmt: skip
        return small.with_system(joints=[*small.system.joints, chain])

    (tangent,) = at(chained, 0.0, bounds=(-0.5, 0.5))
    assert tangent.jointed.joints == {("chain", "limit_force[1]"): pytest.approx(1.0, rel=EXACT)}


def test_what_moves_a_sensor_or_a_base_has_no_rates(small: Model) -> None:
    row = small.sensors[0].row
    moved = at(lambda v: small.with_sensor(small.sensors[0].name, row=(1 + v[0]) * row), 0.0, bounds=(-0.5, 0.5))
    assert moved == [None]
    base = np.ones((2, small.system.n_dof))
    shaken = at(lambda v: replace(small, base_acceleration=(1 + v[0]) * base), 0.0, bounds=(-0.5, 0.5))
    assert shaken == [None]
