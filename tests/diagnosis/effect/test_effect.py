"""What all candidate effects have in common: they vanish, they act, they travel."""

import pickle

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import catalogue
from diagnosis.candidate.effect import Effect
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, QuadraticDamper

LEVEL = 30.0  # N; slips and nearly lifts off


def state(model: Model, omega: float):
    balance = HarmonicBalance(system=model.system, n_harmonic=4, level=LEVEL)
    return steady_state(balance, omega)


def numbers(model: Model) -> list[np.ndarray]:
    """All that an effect may change, as one list."""
    system = model.system
    joints = [
        np.array([value for value in vars(joint).values() if isinstance(value, float)]) for joint in system.joints
    ]
    gains = np.array([each.gain for each in model.sensors])
    return [system.mass, system.damping, system.stiffness, system.static, system.dynamic, gains, *joints]


def same(one: Model, other: Model) -> bool:
    a, b = numbers(one), numbers(other)
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def vanishing(effect: Effect) -> list[float]:
    return [each.vanishes for each in effect.parameters]


def typical(effect: Effect) -> list[float]:
    return [each.typical for each in effect.parameters]


def test_at_its_vanishing_value_an_effect_leaves_all_matrices_loads_gains_and_contacts(bench: Model) -> None:
    for effect in catalogue(bench).candidates:
        left = effect.apply(bench, vanishing(effect))
        own = numbers(bench)
        for before, after in zip(own, numbers(left)[: len(own)], strict=True):
            np.testing.assert_array_equal(after, before, err_msg=effect.name)
        for joint in left.system.joints[len(bench.system.joints) :]:
            assert isinstance(joint, CubicSpring | QuadraticDamper)
            assert (joint.stiffness if isinstance(joint, CubicSpring) else joint.damping) == 0


def test_at_its_vanishing_value_an_effect_leaves_the_response(bench: Model) -> None:
    omega = 2 * np.pi * 14.0
    reference = state(bench, omega)
    size = abs(reference.coefficients).max()
    # Contacts slip here, so that the response asks all of the model.
    shaken = bench.with_joints({name: {"friction_coefficient": 100.0} for name in bench.lines["left"]})
    assert abs(state(shaken, omega).coefficients - reference.coefficients).max() > 1e-3 * size
    for effect in catalogue(bench).candidates:
        found = state(effect.apply(bench, vanishing(effect)), omega)
        # The same operations on the same numbers; a joint more reorders sums.
        np.testing.assert_allclose(found.coefficients, reference.coefficients, rtol=0, atol=1e-12 * size)


def test_every_effect_is_finite_sound_and_different_all_over_its_bounds(bench: Model) -> None:
    draw = np.random.default_rng(5)
    for effect in catalogue(bench, level=LEVEL).candidates:
        for share in (0.0, 1.0, *draw.uniform(size=5)):
            values = [each.lower + share * (each.upper - each.lower) for each in effect.parameters]
            if np.allclose(values, vanishing(effect), rtol=1e-9, atol=0):
                continue
            changed = effect.apply(bench, values)
            assert all(np.isfinite(each).all() for each in numbers(changed)), effect.name
            assert not same(changed, bench), effect.name
            # What a harmonic balance asks of a structure.
            assert np.linalg.eigvalsh(changed.system.mass)[0] > 0, effect.name
            assert np.linalg.eigvalsh(changed.system.stiffness)[0] > 0, effect.name
        assert not same(effect.apply(bench, typical(effect)), bench), effect.name


def test_effects_are_pure(bench: Model) -> None:
    before = [each.copy() for each in numbers(bench)]
    for effect in catalogue(bench).candidates:
        assert same(effect.apply(bench, typical(effect)), effect.apply(bench, typical(effect)))
    for one, other in zip(before, numbers(bench), strict=True):
        np.testing.assert_array_equal(one, other)


def test_every_effect_can_be_pickled(bench: Model) -> None:
    for effect in catalogue(bench).candidates:
        copied = pickle.loads(pickle.dumps(effect))
        assert (copied.name, copied.kind, copied.parameters) == (effect.name, effect.kind, effect.parameters)
        assert same(copied.apply(bench, typical(effect)), effect.apply(bench, typical(effect)))


def test_every_effect_acts_on_the_free_structure_or_leaves_it(bench: Model) -> None:
    free = bench.free()
    for effect in catalogue(bench).candidates:
        applied = effect.apply(free, typical(effect))
        assert same(applied, effect.apply(bench, typical(effect)).free()), effect.name
        contact = effect.kind in {"friction coefficient", "tangential stiffness", "pre-load", "gap"}
        line_sensor = effect.name in {"gain of left_T", "gain of left_N"}
        assert same(applied, free) == (contact or line_sensor), effect.name


def test_every_effect_speaks_in_sentences(bench: Model) -> None:
    for effect in catalogue(bench).candidates:
        for words in (effect.physics, effect.signature):
            assert words.endswith(".")
            assert words[0].isupper()
        assert all(each.unit for each in effect.parameters)


@pytest.mark.parametrize("kind", ["cubic", "air damping"])
def test_an_effect_on_a_model_that_has_it_adds_up(bench: Model, kind: str) -> None:
    effect = next(each for each in catalogue(bench).candidates if each.kind == kind)
    (strength,) = typical(effect)
    twice = effect.apply(effect.apply(bench, [strength]), [2 * strength])
    assert same(twice, effect.apply(bench, [3 * strength]))
