"""Modes of what differs between repeats are the changes that a slightly different test makes."""

from dataclasses import replace
from functools import reduce
from types import ModuleType

import numpy as np
import pytest
import scipy.linalg

from correlation.feature.vector import FeatureVector
from correlation.model import Model, Sensor
from correlation.noise.free_mode import LEAST, MOST_MIXINGS, FreeModes
from correlation.noise.kink import NODE, JitterShift, compute_remainder, make_curvature_modes
from correlation.noise.nuisance import (
    MAX_HISTORY_SHARE,
    Budget,
    ModelFeatures,
    compute_parabolic_share,
    count_contact_sliders,
    draw_normal,
    find_highest_frequency,
    make_error_tangents,
    make_history_modes,
    make_nuisance_modes,
    make_slider_start,
)
from correlation.prediction import Points, Prediction, Predictor
from hbsolve.balance import HarmonicBalance
from reduction.joint_law.friction_contact import Friction
from reduction.jointed_system import CubicSpring, FrictionContact, JointedSystem, along

#: Central differences over 2e-5: their curvature and Newton's 1e-9 stay below this share of a mode's largest number.
NEAR = 1e-4
STEP = 1e-5
#: Errors of natural frequencies: of either configuration, and of each of the four modes. Those of shapes come next, as
#: many as the readings tell of six pairs; then the two stiffnesses of each of two lines.
N_FREQUENCY, N_LINE = 2 + 4, 4


class Bench:
    def __init__(self, model: Model, paper: ModuleType) -> None:
        points = paper.make_points(model)
        self.model = model
        self.predictor = Predictor(points=points)
        self.prediction: Prediction = self.predictor.predict(model)
        motion = np.isin(points.sensor, ["tip", "root"])
        self.features = FeatureVector.choose(points, self.prediction.value, motion)

    def change(self, plus: Model, minus: Model) -> np.ndarray:
        ends = [self.features.of_values(self.predictor.predict(item, self.prediction).value) for item in (minus, plus)]
        return (ends[1] - ends[0]) / (2 * STEP)

    @property
    def nominal(self) -> ModelFeatures:
        return ModelFeatures(self.predictor, self.features, self.model, self.prediction)

    @property
    def n_mode(self) -> int:
        highest = find_highest_frequency(self.features.points)
        return make_error_tangents(self.model, self.prediction, Budget(), highest).n_shared - N_LINE

    @property
    def jitter(self) -> list[np.ndarray]:
        return make_nuisance_modes(self.nominal, Budget(), ()).jitter


@pytest.fixture(scope="module")
def bench(small: Model, paper: ModuleType) -> Bench:
    return Bench(small, paper)


def same(found: np.ndarray, exact: np.ndarray, bench: Bench) -> None:
    points, row = bench.features.points, bench.features.row
    assert np.abs(exact).max() > 0
    for name in np.unique(points.sensor):
        for harmonic in (0, 1, 3):
            of = (points.sensor[row] == name) & (points.harmonic[row] == harmonic)
            if of.any():
                # What does not change (a mean force while nothing slips) is compared with one newton, or its like.
                size = max(np.abs(exact[of]).max(), 1e-3)
                np.testing.assert_allclose(found[of], exact[of], rtol=0, atol=NEAR * size, err_msg=f"{name} {harmonic}")


@pytest.mark.parametrize(("number", "configuration"), [(0, "jointed"), (1, "free")])
def test_the_first_causes_are_shifts_of_frequency(bench: Bench, number: int, configuration: str) -> None:
    ends = [bench.model.with_frequency_shift(configuration, side * STEP) for side in (1, -1)]
    same(bench.jitter[number][:, 0], bench.change(*ends), bench)


@pytest.mark.parametrize(("number", "configuration"), [(2, "jointed"), (3, "free")])
def test_the_next_are_excesses_of_the_force(bench: Bench, number: int, configuration: str) -> None:
    ends = [bench.model.with_force_error(configuration, side * STEP) for side in (1, -1)]
    same(bench.jitter[number][:, 0], bench.change(*ends), bench)


def test_the_last_cause_is_the_preload_of_each_line(bench: Bench) -> None:
    from diagnosis.effect.preload import Preload

    block = bench.jitter[-1]
    assert block.shape[1] == 2
    for line, mode in zip(bench.model.lines, block.T, strict=True):
        ends = [Preload(name=line, target=line).apply(bench.model, [1 + side * STEP]) for side in (1, -1)]
        same(mode, bench.change(*ends), bench)


def test_lines_that_one_screw_presses_have_one_mode(small: Model, paper: ModuleType) -> None:
    bench = Bench(replace(small, linked_preloads=(("right", "left"),)), paper)
    (mode,) = bench.jitter[-1].T
    ends = [
        bench.model.with_preload_ratio("left", 1 + side * STEP).with_preload_ratio("right", 1 + side * STEP)
        for side in (1, -1)
    ]
    same(mode, bench.change(*ends), bench)
    # And so are the histories drawn with: a preload of 0 % scatter draws what no preload at all does.
    of = (bench.nominal, 2, 1)
    np.testing.assert_array_equal(make_history_modes(*of, np.zeros((1, 1))), make_history_modes(*of))
    assert make_history_modes(*of, np.array([[1e-4]])).shape == make_history_modes(*of).shape


def test_a_model_without_lines_has_frequencies_and_forces_alone(small: Model, paper: ModuleType) -> None:
    free = small.without_contacts()
    points = paper.make_points(small)
    kept = points.where(points.free)
    predictor = Predictor(points=kept)
    prediction = predictor.predict(free)
    features = FeatureVector.choose(kept, prediction.value, np.ones(len(kept), dtype=bool))
    blocks = make_nuisance_modes(ModelFeatures(predictor, features, free, prediction), Budget(), ()).jitter
    assert [block.shape[1] for block in blocks if block.size] == [1] * 4
    assert make_history_modes(ModelFeatures(predictor, features, free, prediction), 2, 1).shape == (
        len(features.row),
        0,
    )


def test_the_budget_scales_with_its_numbers(bench: Bench) -> None:
    def modes(budget: Budget) -> np.ndarray:
        return make_nuisance_modes(bench.nominal, budget, ()).budget

    one = modes(Budget(frequency=1e-3, compliance=0.01))
    assert one.shape == (len(bench.features.row), bench.n_mode + N_LINE)
    twice = modes(Budget(frequency=2e-3, compliance=0.03))
    # A product.
    np.testing.assert_allclose(twice, one * np.array([2.0] * bench.n_mode + [3.0] * N_LINE), rtol=1e-12)


def test_each_natural_frequency_is_off_by_itself(bench: Bench) -> None:
    """The second one 1e-5 higher, with mode shapes and damping as they are."""
    modes = make_nuisance_modes(bench.nominal, Budget(frequency=1.0), ()).budget
    system = bench.model.system
    squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    weighted = system.mass @ shapes
    ends = []
    for side in (1, -1):
        moved = squared * (1 + 2 * side * STEP * (np.arange(len(squared)) == 1))
        ends.append(bench.model.with_system(stiffness=weighted * moved @ weighted.T))
    # Two are common to all modes.
    same(modes[:, 3], bench.change(*ends), bench)


def test_mode_shapes_mix_as_a_random_matrix_says(bench: Bench) -> None:
    """Stiffnesses of sqrt 2 e omega_i omega_j between two modes of unit mass, e independent and of unit variance."""
    modes = make_nuisance_modes(bench.nominal, Budget(frequency=1.0), ()).budget[:, N_FREQUENCY : bench.n_mode]
    system = bench.model.system
    squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    weighted, omega = system.mass @ shapes, np.sqrt(squared)
    changes = []
    for i, j in zip(*np.triu_indices(4, 1), strict=True):
        mixed = np.outer(weighted[:, i], weighted[:, j])
        error = np.sqrt(2) * omega[i] * omega[j] * (mixed + mixed.T)
        ends = [bench.model.with_system(stiffness=system.stiffness + side * STEP * error) for side in (1, -1)]
        changes.append(bench.change(*ends))
    exact = np.array(changes).T @ np.array(changes)
    np.testing.assert_allclose(modes @ modes.T, exact, rtol=0, atol=NEAR * np.abs(exact).max())


@pytest.mark.parametrize(
    "amplitudes", [[[1.0]], [[1.0, 0, 0], [0, 1e-2, 0], [0, 0, 1e-3]], [[1.0, 0.2j, 0], [0.3, 1, 0.1]]]
)
def test_few_errors_of_shapes_say_what_many_modes_do(amplitudes: list[list[complex]]) -> None:
    """A chain of 40 masses read at three places, in one state or more: few combinations of 114 pairs give what is seen.

    Each mode's shape gets a share of every other one by perturbation theory, and all modes keep their amplitudes.
    """
    n, places = 40, [12, 25, 39]
    stiffness = (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) * n**2
    stiffness[-1, -1] = n**2
    squared, shapes = np.linalg.eigh(stiffness)
    modes = FreeModes(frequency=np.sqrt(squared), shapes=shapes.T, weighted=shapes.T, n_reached=3)
    carried = np.array(amplitudes, dtype=complex)
    motions = carried @ shapes[:, : carried.shape[1]].T
    result = modes.shape_errors(motions, [np.eye(n)[places]])
    assert len(result) <= MOST_MIXINGS
    with np.errstate(divide="ignore"):
        apart = np.where(np.eye(n) == 1, np.inf, squared[:, None] - squared)

    def shift(error: np.ndarray) -> np.ndarray:
        """Relative change of all readings, in phase and out of phase."""
        share = (shapes.T @ error @ shapes) / apart
        moved = carried @ (share @ shapes.T)[: carried.shape[1], places]
        relative = (moved / np.abs(motions[:, places])).ravel()
        return np.concatenate([relative.real, relative.imag])

    def pair(i: int, j: int) -> np.ndarray:
        mixed = np.sqrt(2 * squared[i] * squared[j]) * np.outer(shapes[:, i], shapes[:, j])
        return np.asarray(mixed + mixed.T)

    taken = np.array(
        [shift(item.free.matrices.stiffness) for item in result if item.free.matrices.stiffness is not None]
    )
    exact = np.array([shift(pair(i, j)) for i in range(3) for j in range(i + 1, n)])
    covariance = exact.T @ exact
    # Combinations below LEAST of the largest are left out; the covariance has their squares.
    np.testing.assert_allclose(taken.T @ taken, covariance, rtol=0, atol=10 * LEAST**2 * np.abs(covariance).max())


def test_errors_that_are_fitted_are_no_modes(bench: Bench) -> None:
    every = make_nuisance_modes(bench.nominal, Budget(frequency=1.0), ()).budget
    others = make_nuisance_modes(bench.nominal, Budget(frequency=1.0, fitted=(1,)), ()).budget
    np.testing.assert_allclose(others, np.delete(every, [0, 1, 3], axis=1), rtol=1e-9, atol=1e-12)


def test_the_budget_of_natural_frequencies_leaves_the_exciter_alone(bench: Bench) -> None:
    """All natural frequencies of the free structure 1e-5 lower: (1 + 2 e) M and (1 + e) C, read at the same Omega."""
    modes = make_nuisance_modes(bench.nominal, Budget(frequency=1.0), ()).budget
    system = bench.model.system
    ends = [
        bench.model.with_system(mass=(1 + 2 * side * STEP) * system.mass, damping=(1 + side * STEP) * system.damping)
        for side in (1, -1)
    ]
    free = bench.features.points.free[bench.features.row]
    same(modes[:, 1], np.where(free, bench.change(*ends), 0.0), bench)


def test_a_line_that_is_stiffer_is_a_mode_of_the_budget(bench: Bench) -> None:
    modes = make_nuisance_modes(bench.nominal, Budget(compliance=1.0), ()).budget
    names = bench.model.lines["left"]
    ends = [
        bench.model.with_joints({name: {"tangential_stiffness": 5e3 * (1 + side * STEP)} for name in names})
        for side in (1, -1)
    ]
    same(modes[:, bench.n_mode], bench.change(*ends), bench)


def test_a_finer_model_adds_its_difference_at_each_level(bench: Bench, paper: ModuleType) -> None:
    finer = bench.model.with_system(stiffness=1.001 * bench.model.system.stiffness)
    modes = make_nuisance_modes(bench.nominal, Budget(), [finer]).budget[:, bench.n_mode + N_LINE :]
    values = [bench.predictor.predict(item).value for item in (finer, bench.model)]
    change = bench.features.of_values(values[0]) - bench.features.of_values(values[1])
    level = bench.features.points.level[bench.features.row]
    assert modes.shape[1] == len(paper.LEVELS)
    # Newton's 1e-9, from other starts; third harmonics are 1e-2 of the motion.
    for mode, item in zip(modes.T, paper.LEVELS, strict=True):
        expected = np.where(level == item, change, 0.0)
        np.testing.assert_allclose(mode, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


SHARED = ("preload", "tangential_stiffness", "normal_stiffness")
#: Of the three contacts of each line, between the masses (0) and (1); unevenly, so that shares change the static load.
WEIGHT, STATION = np.array([0.2, 0.5, 0.3]), (0.1, 0.3, 0.9)


@pytest.fixture(scope="module")
def long(small: Model, paper: ModuleType) -> Bench:
    joints, lines = [], {}
    # Pressed differently, so that the static loads of the two lines do not cancel.
    for name, side, preload in (("left", 1.0, 8.0), ("right", -1.0, 5.0)):
        for number, (weight, where) in enumerate(zip(WEIGHT, STATION, strict=True)):
            z, x = along(4, {0: 1 - where, 2: where}), along(4, {1: 1 - where, 3: where})
            joints.append(
                FrictionContact(
                    name=f"{name} {number}", normal=side * (0.3 * z + 0.8 * x), tangents=0.9 * z,
                    normal_stiffness=2e4 * weight, tangential_stiffness=1e4 * weight, friction_coefficient=0.4,
                    preload=preload * weight,
                )
            )  # fmt: skip
        lines[name] = tuple(f"{name} {number}" for number in range(3))
    static = sum(joint.preload * joint.normal for joint in joints)
    model = replace(small, system=replace(small.system, joints=joints, static_load=static), lines=lines)
    return Bench(model, paper)


@pytest.mark.parametrize("weights", [(1.0, 4.0, 1.0), (0.2, 0.5, 0.3), (1.0, 4.0, 2.0, 4.0, 1.0), (3.0, 1.0, 3.0)])
def test_a_bulge_moves_shares_to_the_ends_and_keeps_their_sum_and_balance(weights: tuple[float, ...]) -> None:
    share, place = np.array(weights), np.linspace(-1, 1, len(weights))
    pattern = compute_parabolic_share(share)
    # Round-off.
    assert share @ pattern == pytest.approx(0.0, abs=1e-14 * share.sum())
    assert share @ (pattern * place) == pytest.approx(0.0, abs=1e-14 * share.sum())
    assert np.abs(pattern[[0, -1]]).max() == pytest.approx(1.0)
    # Both ends gain what the middle loses, or the other way round.
    assert pattern[0] * pattern[-1] > 0
    assert pattern[0] * pattern[len(weights) // 2] < 0


@pytest.mark.parametrize("weights", [(1.0,), (1.0, 1.0), (1.0, 0.0, 1.0)])
def test_lines_of_two_contacts_or_idle_ones_share_nothing(weights: tuple[float, ...]) -> None:
    np.testing.assert_array_equal(compute_parabolic_share(np.array(weights)), 0.0)


@pytest.mark.filterwarnings("error")
def test_contacts_that_pull_share_as_those_that_press_and_of_both_kinds_nothing() -> None:
    press = np.array([1.0, 4.0, 2.0])
    np.testing.assert_array_equal(compute_parabolic_share(-press), compute_parabolic_share(press))
    np.testing.assert_array_equal(compute_parabolic_share(np.array([1.0, -4.0, 2.0])), 0.0)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_other_shares_of_the_lines_are_modes_of_each_level(long: Bench, paper: ModuleType, number: int) -> None:
    field, n_level = SHARED[number], len(paper.LEVELS)
    modes = make_nuisance_modes(long.nominal, Budget(shares=1.0), ()).budget
    assert modes.shape[1] == long.n_mode + N_LINE + len(SHARED) * n_level
    pattern, ends = compute_parabolic_share(WEIGHT), []
    for side in (1, -1):
        values, static = {}, np.array(long.model.system.static)
        for names in long.model.lines.values():
            for name, rate in zip(names, pattern, strict=True):
                contact = long.model.contact(name)
                before = getattr(contact, field)
                values[name] = {field: before * (1 + side * STEP * rate)}
                if field == "preload":
                    static += side * STEP * rate * before * contact.normal
        ends.append(long.model.with_joints(values).with_system(static_load=static))
    change, level = long.change(*ends), long.features.points.level[long.features.row]
    for place, item in enumerate(paper.LEVELS):
        mode = modes[:, long.n_mode + N_LINE + number * n_level + place]
        expected = np.where(level == item, change, 0.0)
        if np.abs(expected).max() > 1e-6:
            same(mode, expected, long)
        else:
            # Other preloads change nothing while all contacts stick: Newton's 1e-9 over the step.
            assert np.abs(mode).max() < 1e-6


def test_histories_are_drawn_for_each_level_and_leave_the_free_structure(bench: Bench, paper: ModuleType) -> None:
    n_draw = 4
    modes = make_history_modes(bench.nominal, n_draw, 7)
    points, row = bench.features.points, bench.features.row
    assert modes.shape == (len(row), len(paper.LEVELS) * (n_draw + 1))
    assert not modes[points.free[row]].any()
    for number, level in enumerate(paper.LEVELS):
        block = modes[:, number * (n_draw + 1) : (number + 1) * (n_draw + 1)]
        assert not block[points.level[row] != level].any()
        # The draws are about their mean.
        np.testing.assert_allclose(block[:, :n_draw].sum(axis=1), 0, atol=1e-12 * np.abs(block).max())


def test_histories_grow_with_the_preloads_of_their_draws(bench: Bench, paper: ModuleType) -> None:
    """What sticks keeps a share of its limit: 1 % more preload of all lines is 1 % more of what a history does."""
    n_draw, seed, together = 4, 7, np.full((2, 2), 1e-4)
    points = paper.make_points(bench.model).where(paper.make_points(bench.model).level == paper.LEVELS[0])
    for column in ("level", "force"):
        object.__setattr__(points, column, np.full(len(points), 1e-3))
    predictor = Predictor(points=points)
    prediction = predictor.predict(bench.model)
    features = FeatureVector.choose(points, prediction.value, np.isin(points.sensor, ["tip", "root"]))
    plain, none, pressed = (
        make_history_modes(ModelFeatures(predictor, features, bench.model, prediction), n_draw, seed, covariance)
        for covariance in (None, np.zeros((2, 2)), together)
    )
    np.testing.assert_array_equal(none, plain)
    more = draw_normal(together, n_draw, seed)[:, 0]
    before, after = (item[:, :-1] * np.sqrt(n_draw - 1) + item[:, -1:] for item in (plain, pressed))
    # Newton's 1e-9 of forces that are some hundred times what a history leaves of them in a line's sum.
    np.testing.assert_allclose(after, before * (1 + more), rtol=0, atol=1e-6 * np.abs(before).max())


#: Contacts that histories are drawn for, and the least and the largest covariance in any direction, relative to the
#: exact one. 16 points of 2 sliders stay within 0.95 to 1.18 and those of 4 within 0.86 to 1.28 in 200 Latin hypercubes
#: of low discrepancy; 16 random points within 0.25 to 2.4 and 0.13 to 2.8.
SPREAD = {("left",): (0.95, 1.18), ("left", "right"): (0.86, 1.28)}


def test_draws_have_their_covariance_and_do_not_depend_on_round_off() -> None:
    random = np.random.default_rng(3)
    root = random.standard_normal((3, 3))
    covariance = np.zeros((5, 5))  # two of the numbers do not scatter
    covariance[:3, :3] = root @ root.T
    drawn = draw_normal(covariance, 40_000, 1)
    # The mean of 40,000 squares is known to 0.7 %.
    np.testing.assert_allclose(drawn.T @ drawn / len(drawn), covariance, atol=0.03 * covariance.max())
    # Entries of round-off turn the signs of the directions that a factorisation finds.
    for _ in range(10):
        noise = 1e-16 * covariance.max() * random.standard_normal((5, 5))
        np.testing.assert_allclose(draw_normal(covariance + noise + noise.T, 8, 1), drawn[:8], atol=1e-6)


@pytest.mark.parametrize("lines", SPREAD)
@pytest.mark.parametrize("seed", range(1, 4))
def test_histories_of_contacts_that_stick_have_the_covariance_of_all_that_the_cone_allows(
    small: Model, lines: tuple[str, ...], seed: int
) -> None:
    """Static forces within Coulomb's cone bend the structure linearly, (K + kt t t' + kn n n') u = - sum f t."""
    system, n_draw = small.system, 16
    joints = [small.contact(name) for line in lines for name in small.lines[line]]
    model = replace(
        small,
        system=replace(
            system, joints=joints, static_load=np.sum([item.preload * item.normal for item in joints], axis=0)
        ),
        lines={line: small.lines[line] for line in lines},
        sensors=tuple(Sensor(name=f"u{dof}", row=along(4, {dof: 1.0})) for dof in range(4)),
    )
    # At next to no level the contacts stick.
    points = Points(
        free=np.zeros(4, dtype=bool), level=np.full(4, 1e-6), frequency=np.full(4, 25.0),
        sensor=np.array([sensor.name for sensor in model.sensors]), harmonic=np.zeros(4, dtype=np.int64),
    )  # fmt: skip
    predictor = Predictor(points=points)
    prediction = predictor.predict(model)
    features = FeatureVector.choose(points, prediction.value, np.ones(4, dtype=bool))
    modes = make_history_modes(ModelFeatures(predictor, features, model, prediction), n_draw, seed)
    tangents = np.array([np.ravel(item.tangents) for item in joints]).T
    normals = np.array([item.normal for item in joints]).T
    springs = [item.tangential_stiffness for item in joints], [item.normal_stiffness for item in joints]
    stiffness = system.stiffness + tangents * springs[0] @ tangents.T + normals * springs[1] @ normals.T
    limit = np.array([item.friction_coefficient * item.preload for item in joints])
    # A share that is even from -HISTORY to HISTORY has a third of its square as variance.
    one = np.linalg.solve(stiffness, tangents * limit) * MAX_HISTORY_SHARE / np.sqrt(3)
    basis, size, _ = np.linalg.svd(one)
    # Both lines push alike at either station: two independent directions.
    n = 2
    assert size[n:].max(initial=0.0) < 1e-12 * size[0]
    seen = basis[:, :n].T @ modes[:, :n_draw] / size[:n, None]
    # Newton's 1e-9, off the directions that there are.
    np.testing.assert_allclose(basis[:, n:].T @ modes, 0, atol=1e-6 * size[0])
    spread = np.linalg.eigvalsh(seen @ seen.T)
    least, largest = SPREAD[lines]
    assert least < spread[0] <= spread[-1] < largest
    # The mean of the draws is off by less than a tenth of their deviation: each slider is drawn once in every 16th.
    assert np.abs(basis[:, :n].T @ modes[:, -1] / size[:n]).max() < 0.1


def test_a_history_within_the_cone_changes_no_contact_that_sticks(bench: Bench, paper: ModuleType) -> None:
    """At so low a level that 90 % of Coulomb's limit leave the contacts stuck, the response is that without history."""
    points = paper.make_points(bench.model).where(paper.make_points(bench.model).level == paper.LEVELS[0])
    object.__setattr__(points, "level", np.full(len(points), 1e-3))
    predictor = Predictor(points=points)
    prediction = predictor.predict(bench.model)
    features = FeatureVector.choose(points, prediction.value, np.isin(points.sensor, ["tip", "root"]))
    modes = make_history_modes(ModelFeatures(predictor, features, bench.model, prediction), 4, 7)
    fundamental = np.isin(points.sensor, ["tip", "root"])[features.row] & (points.harmonic[features.row] == 1)
    assert MAX_HISTORY_SHARE < 1
    # A stuck contact is linear: round-off, relative to F / X.
    stiffness = np.abs(features.of_values(prediction.value)[fundamental]).max()
    assert np.abs(modes[fundamental]).max() < 1e-7 * stiffness


@pytest.mark.parametrize("friction", Friction)
def test_histories_fill_what_two_tangents_can_carry(friction: Friction) -> None:
    contact = FrictionContact(
        name="pad", normal=np.eye(3)[2], tangents=np.eye(3)[:2], tangential_stiffness=1e5, normal_stiffness=1e5,
        friction_coefficient=0.5, preload=10.0, friction=friction,
    )  # fmt: skip
    spring = CubicSpring(name="spring", direction=np.eye(3)[0], stiffness=1.0)
    system = JointedSystem(mass=np.eye(3), damping=np.eye(3), stiffness=1e4 * np.eye(3), joints=[spring, contact])
    model, balance = Model(system=system, sensors=(), n_harmonic=2), HarmonicBalance(system=system, n_harmonic=2)
    assert count_contact_sliders(model) == 2
    histories = np.random.default_rng(1).uniform(size=(2000, 2))
    forces = 1e5 * np.array([make_slider_start(model, item)(balance) for item in histories])
    limit = MAX_HISTORY_SHARE * 5.0
    if friction is Friction.COULOMB:
        size = np.hypot(*forces.T)
        assert size.max() <= limit * (1 + 1e-12)
        # Half of a circle lies beyond 1 / sqrt(2) of its radius; a share of 2000 has a standard deviation of 1.1 %.
        assert np.mean(size > limit / np.sqrt(2)) == pytest.approx(0.5, abs=0.05)
    assert np.abs(forces).max() <= limit * (1 + 1e-12)
    assert abs(np.corrcoef(forces.T)[0, 1]) < 0.1


def test_curvature_is_the_mean_that_jitter_leaves_behind(bench: Bench) -> None:
    """Of a normal jitter, features are on average off by half their second derivative times its variance."""
    deviation = {"jointed": 2e-3, "free": 1e-3}
    plus, minus, half_plus, half_minus = (
        reduce(
            lambda model, item: model.with_frequency_shift(item[0], share * NODE * item[1]),
            deviation.items(),
            bench.model,
        )
        for share in (1, -1, 0.5, -0.5)
    )
    change = NODE * sum(block[:, 0] * size for block, size in zip(bench.jitter, deviation.values(), strict=False))
    free = bench.features.points.free[bench.features.row]
    shift = JitterShift(models=(plus, minus), halves=(half_plus, half_minus), change=np.asarray(change))
    curved = make_curvature_modes([compute_remainder(bench.nominal, shift).smooth], free, np.inf)
    # Of many repeats each end leaves its share of the mean: up and down of the jointed, then of the free structure.
    modes = np.column_stack([curved[:, :2].sum(axis=1), curved[:, 2:].sum(axis=1)])
    nominal = bench.features.of_values(bench.prediction.value)
    for mode, (name, size), here in zip(modes.T, deviation.items(), (~free, free), strict=True):
        assert not mode[~here].any()
        ends = [
            bench.features.of_values(
                bench.predictor.predict(bench.model.with_frequency_shift(name, side * size), bench.prediction).value
            )
            for side in (1, -1)
        ]
        expected = np.where(here, (ends[0] + ends[1]) / 2 - nominal, 0.0)
        # The fourth order of a share of 1e-3 of the frequency, a twentieth of the resonance's width.
        near = np.abs(mode - expected) <= 0.05 * np.abs(expected).max()
        # Where contacts begin to slip a response has no second derivative: at a few states of the jointed structure.
        assert near[here].mean() > (0.95 if name == "jointed" else 0.999)
        assert np.abs(mode).max() > 1e-4
