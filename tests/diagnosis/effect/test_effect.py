"""What all candidate effects have in common: they vanish, they act, they travel."""

import pickle
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.model import DeadWeight, Head, Model, Sensor, Wire
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import measure_scale
from diagnosis.effect import EFFECTS, EffectKind
from diagnosis.fit.arrangement import arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.refit import make_baseline_refit, refit
from diagnosis.screening import screen
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.elastic_support import ElasticBody, ElasticSupport
from reduction.jointed_system import CubicSpring, JenkinsElement, QuadraticDamper
from tests.slow import slow

LEVEL = 30.0  # N; slips and nearly lifts off


@pytest.fixture(scope="module")
def bench(bench: Model) -> Model:
    """The bench with a lap, a stand on a clamp, a laser that may lean, and a weight on a wire on its left line."""
    n = bench.system.n_dof
    vertical, across = (bench.places[name] for name in ("slot z", "tip x"))
    wire = Wire(force=2.0, shift=0.0, inclination=0.1, horizontal=across, vertical=vertical, moment=20 * across)
    motion = np.zeros((n, 6))
    motion[n - 1, 2] = 1.0
    stand = bench.parts[1]
    support = ElasticSupport(
        motion=motion, inertia=stand.mass @ motion, mass=motion.T @ stand.mass @ motion, springs=np.eye(6),
        body=np.zeros((0, 6)),
    )  # fmt: skip
    clamp = ElasticBody(mass=stand.mass, stiffness=stand.stiffness, support=support, compliance=0.0)
    laser = Sensor.laser("laser", {"tip": Head(along=bench.places["tip z"], across=across)})
    lap = JenkinsElement(name="lap", direction=bench.places["slot z"], tangential_stiffness=3e3, limit_force=2.0)
    return replace(
        bench.with_system(joints=[*bench.system.joints, lap]), joint_groups={"lap": ("lap",)},
        sensors=(*bench.sensors, laser), dead_weights={"weight": DeadWeight.on_wire(wire, ("left",))},
        elastic_bodies={"stand": clamp},
    )  # fmt: skip


def state(model: Model, omega: float):
    balance = HarmonicBalance(system=model.system, n_harmonic=4, level=LEVEL)
    return steady_state(balance, omega)


def numbers(model: Model) -> list[np.ndarray]:
    """All that an effect may change, as one list."""
    system = model.system
    joints = [
        np.array([value for value in vars(joint).values() if isinstance(value, float)]) for joint in system.joints
    ]
    gains = np.array([(item.gain, item.delay) for item in model.sensors])
    rows = np.array([item.row for item in model.sensors if isinstance(item, Sensor)])
    return [system.mass, system.damping, system.stiffness, system.static, system.dynamic, gains, rows, *joints]


def same(one: Model, other: Model) -> bool:
    a, b = numbers(one), numbers(other)
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def vanishing(effect: Effect) -> list[float]:
    return [item.vanishes for item in effect.parameters]


def typical(effect: Effect) -> list[float]:
    return [item.typical for item in effect.parameters]


@pytest.fixture(params=EFFECTS.names())
def effect_kind(request: pytest.FixtureRequest) -> EffectKind:
    return EFFECTS[request.param]


@pytest.fixture(params=["preload", pytest.param("mass", marks=slow)])
def planted_kind(request: pytest.FixtureRequest) -> EffectKind:
    """Some of them: a campaign and its calibration take seconds each."""
    return EFFECTS[request.param]


def effects(kind: EffectKind, model: Model, level: float = 1.0) -> list[Effect]:
    """All of a kind on a model that can be tested."""
    result = [
        item for item in kind.candidates(model, measure_scale(model, level=level)) if not isinstance(item, Untestable)
    ]
    assert result
    return result


def test_at_its_vanishing_value_an_effect_leaves_all_matrices_loads_gains_and_contacts(
    effect_kind: EffectKind, bench: Model
) -> None:
    for effect in effects(effect_kind, bench):
        left = effect.apply(bench, vanishing(effect))
        own = numbers(bench)
        for before, after in zip(own, numbers(left)[: len(own)], strict=True):
            np.testing.assert_array_equal(after, before, err_msg=effect.name)
        for joint in left.system.joints[len(bench.system.joints) :]:
            assert isinstance(joint, CubicSpring | QuadraticDamper)
            assert (joint.stiffness if isinstance(joint, CubicSpring) else joint.damping) == 0


def test_at_its_vanishing_value_an_effect_leaves_the_response(effect_kind: EffectKind, bench: Model) -> None:
    omega = 2 * np.pi * 14.0
    reference = state(bench, omega)
    size = abs(reference.coefficients).max()
    # Contacts slip here, so that the response asks all of the model.
    shaken = bench.with_joints({name: {"friction_coefficient": 10.0} for name in bench.lines["left"]})
    assert abs(state(shaken, omega).coefficients - reference.coefficients).max() > 1e-3 * size
    for effect in effects(effect_kind, bench):
        result = state(effect.apply(bench, vanishing(effect)), omega)
        # The same operations on the same numbers; a joint more reorders sums.
        np.testing.assert_allclose(result.coefficients, reference.coefficients, rtol=0, atol=1e-12 * size)


def test_every_effect_is_finite_sound_and_different_all_over_its_bounds(effect_kind: EffectKind, bench: Model) -> None:
    draw = np.random.default_rng(5)
    for effect in effects(effect_kind, bench, level=LEVEL):
        for share in (0.0, 1.0, *draw.uniform(size=5)):
            values = [item.lower + share * (item.upper - item.lower) for item in effect.parameters]
            if np.allclose(values, vanishing(effect), rtol=1e-9, atol=0):
                continue
            changed = effect.apply(bench, values)
            assert all(np.isfinite(item).all() for item in numbers(changed)), effect.name
            assert not same(changed, bench), effect.name
            # What a harmonic balance asks of a structure.
            assert np.linalg.eigvalsh(changed.system.mass)[0] > 0, effect.name
            assert np.linalg.eigvalsh(changed.system.stiffness)[0] > 0, effect.name
        assert not same(effect.apply(bench, typical(effect)), bench), effect.name


def test_effects_are_pure(effect_kind: EffectKind, bench: Model) -> None:
    before = [item.copy() for item in numbers(bench)]
    for effect in effects(effect_kind, bench):
        assert same(effect.apply(bench, typical(effect)), effect.apply(bench, typical(effect)))
    for one, other in zip(before, numbers(bench), strict=True):
        np.testing.assert_array_equal(one, other)


def test_every_effect_can_be_pickled(effect_kind: EffectKind, bench: Model) -> None:
    for effect in effects(effect_kind, bench):
        copied = pickle.loads(pickle.dumps(effect))
        assert (copied.name, copied.kind, copied.parameters) == (effect.name, effect.kind, effect.parameters)
        assert same(copied.apply(bench, typical(effect)), effect.apply(bench, typical(effect)))


def test_every_effect_acts_on_the_free_structure_or_leaves_it(effect_kind: EffectKind, bench: Model) -> None:
    free = bench.without_contacts()
    for effect in effects(effect_kind, bench):
        applied = effect.apply(free, typical(effect))
        assert same(applied, effect.apply(bench, typical(effect)).without_contacts()), effect.name
        contact = "contact line" in effect_kind.acts_on or "wire" in effect_kind.acts_on
        line_sensor = effect.name.removeprefix("gain of ").removeprefix("delay of ") in {"left_T", "left_N"}
        assert same(applied, free) == (contact or line_sensor), effect.name


def test_every_effect_speaks_in_sentences(effect_kind: EffectKind, bench: Model) -> None:
    for effect in effects(effect_kind, bench):
        for words in (effect.physics, effect.signature):
            assert words.endswith(".")
            assert words[0].isupper()
        assert all(item.unit for item in effect.parameters)


def test_effects_are_as_their_kind_says(effect_kind: EffectKind, bench: Model) -> None:
    for effect in effects(effect_kind, bench):
        assert effect.kind == effect_kind.name
        assert [item.name for item in effect.parameters] == list(effect_kind.parameters)
        for item in effect.parameters:
            assert item.unit in effect_kind.parameters[item.name]


def test_planted_it_is_found(planted_kind: EffectKind, small: Model, paper: ModuleType) -> None:
    """The strength that a refit finds is the planted one; the screening promises what the refit keeps."""
    effect = effects(planted_kind, small, level=paper.LEVELS[1])[-1]
    parameter = effect.parameters[0]
    strength = parameter.vanishes + 2 * (parameter.typical - parameter.vanishes)
    rest = [item.typical for item in effect.parameters[1:]]
    campaign = paper.make_campaign(effect.apply(small, [strength, *rest]), jitter=3e-5, seed=5)
    free = list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0})
    arrangement = arrange(campaign, small, free, Budget(frequency=0.0, compliance=0.0))
    (score,) = screen(arrangement, [effect])
    result = refit(arrangement, score)
    before = make_baseline_refit(arrangement)
    # Five standard deviations, by the curvature of chi^2 alone: friction histories stray a little further.
    assert result.strength == pytest.approx(strength, abs=5 * result.deviation)
    assert result.deviation < 0.2 * abs(strength - parameter.vanishes)
    # A promise to first order, at the strength that the screening tried.
    assert arrangement.fit.chi2 - result.fit.chi2 == pytest.approx(score.gain, rel=0.4)
    assert result.held_out_reduced_chi2 < before.held_out_reduced_chi2


@pytest.mark.parametrize("kind", ["cubic", "air damping"])
def test_an_effect_on_a_model_that_has_it_adds_up(bench: Model, kind: str) -> None:
    effect = next(item for item in list_effects(bench).candidates if item.kind == kind)
    (strength,) = typical(effect)
    twice = effect.apply(effect.apply(bench, [strength]), [2 * strength])
    assert same(twice, effect.apply(bench, [3 * strength]))
