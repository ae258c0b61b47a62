"""Signatures of candidates on a chain beside draws of its measurements; the list of tests."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.prediction import Predictor
from diagnosis.candidate.catalogue import list_effects
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.next_test.advise import rank_tests
from diagnosis.next_test.candidate_model import CandidateModel
from diagnosis.next_test.list_tests import Tested, list_tests
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.planned_noise import NoiseLaw, PlannedNoise
from diagnosis.next_test.separation import compute_decision_probability
from diagnosis.next_test.signature import ErrorSources, SetUpSignatures
from tests.diagnosis.missing_law.chain import FREQUENCIES, PLACES, make_chain

#: Masses that lower the first resonance alike [kg], and the relative deviations of all parameters.
MASSES, DEVIATION = {"mass at m1": 0.05, "mass at m2": 0.0326}, {"E": 1e-3, "zeta": 0.02, "mass": 0.03}
SOURCES = ErrorSources(
    jitter=[], budget=Budget(frequency=0.0, compliance=0.0, shares=0.0), noise=PlannedNoise(usual=NoiseLaw(4e-3, 1e-6))
)
TEST = NextTest(
    name="again", configuration="jointed", levels=(0.2,), frequencies=tuple(FREQUENCIES[::2].tolist()),
    sensors=("at m2",), place="m1", n_repeat=2,
)  # fmt: skip


def make_model() -> Model:
    """The chain with a sensor on its last mass alone."""
    chain = make_chain()
    return replace(chain, sensors=tuple(item for item in chain.sensors if item.name == "at m2"))


def make_candidates() -> list[CandidateModel]:
    model = make_model()
    calibration = list_calibration_parameters(model, deviation={"E": 0.005})
    names = [item.name for item in calibration]
    result = []
    for name, mass in MASSES.items():
        effect = list_effects(model).effect(name)
        unknowns = Unknowns.from_effects(model, [(item, item.deviation) for item in calibration], [effect])
        values = np.array([*unknowns.vanishing[:-1], mass])
        deviation = np.array([*(DEVIATION[item] for item in names), DEVIATION["mass"] * mass])
        result.append(
            CandidateModel(
                name=name, probability=0.5, unknowns=unknowns, fit_values=values, covariance=np.diag(deviation**2),
                model=unknowns.compose(values),
            )
        )  # fmt: skip
    return result


def test_decisions_on_a_chain_are_as_probable_as_among_draws_of_its_measurements() -> None:
    candidates = make_candidates()
    signatures = SetUpSignatures.predict(candidates, [TEST], SOURCES)
    separation = signatures.separate(TEST)
    expected = compute_decision_probability(separation, np.array([0.5, 0.5]))
    # Each candidate in turn is true, with parameters drawn from what is known of it.
    random, points, n = np.random.default_rng(1), signatures.points, 70
    predictor, odds = Predictor(points=points), []
    features, _ = signatures.compare(TEST)
    means, spreads, whitening = signatures.list_features(TEST)
    wholes = [whitening.with_modes(item) for item in spreads]
    place = np.eye(3)[1]
    for number, candidate in enumerate(candidates):
        for _ in range(n):
            values = candidate.fit_values + candidate.root @ random.standard_normal(len(candidate.fit_values))
            model = candidate.unknowns.compose(values)
            sensors = (*model.sensors, replace(model.sensors[0], name="further sensor at m1", row=place))
            exact = predictor.predict(replace(model, sensors=sensors)).value
            noise = SOURCES.noise.deviation(points, exact) / np.sqrt(TEST.n_repeat)
            error = random.standard_normal(len(points)) + 1j * random.standard_normal(len(points))
            y = features.of_values(exact + noise * error)
            costs = [float(np.sum(w(y - mean) ** 2)) + w.log_determinant for w, mean in zip(wholes, means, strict=True)]
            odds.append((costs[1 - number] - costs[number]) / 2)
    decided = float(np.mean(np.array(odds) >= np.log(19)))
    assert 0.2 < expected < 0.98
    # Three standard errors of a share of 140 draws, of at most 0.042 each.
    assert decided == pytest.approx(expected, abs=0.125)
    # The mean of the log odds within four of its standard errors, and a tenth for the same reason.
    error = 4 * np.sqrt(separation[0, 1] / (2 * n))
    assert np.mean(odds) == pytest.approx(separation[0, 1] / 2, abs=error + 0.1 * separation[0, 1] / 2)
    assert signatures.take_curve(TEST).sensor in {"at m2", "further sensor at m1"}


def test_predictions_that_bend_within_what_is_known_separate_less() -> None:
    straight = make_candidates()
    bent = []
    for item in straight:
        along = np.array([*np.zeros(len(item.fit_values) - 1), 0.5 * item.fit_values[-1]])
        ends = (item.unknowns.compose(item.fit_values + along), item.unknowns.compose(item.fit_values - along))
        bent.append(replace(item, curvature_pair=ends))
    result = [SetUpSignatures.predict(item, [TEST], SOURCES).separate(TEST)[0, 1] for item in (straight, bent)]
    assert 0 < result[1] < result[0]


def test_the_test_that_takes_least_is_advised_among_those_that_decide_alike() -> None:
    model = make_model()
    tested = Tested(
        levels=np.array([0.1, 0.3]), frequencies=FREQUENCIES, configurations=("jointed",), sensors=("at m2",),
        motions=("at m2",), harmonics=(1,), sweeps=(1,),
    )  # fmt: skip
    tests = list_tests(tested, model, 1 / (1 + (FREQUENCIES - FREQUENCIES.mean()) ** 2))
    names = {item.name for item in tests}
    assert {"the same tests again", "a higher level", "a lower level", "the sweep down"} <= names
    assert {item.place for item in tests} == {None, "m0", "m1"}
    # The chain has no contacts to open or to press, and nothing that makes harmonics.
    assert not any("contacts" in name or "preload" in name or "harmonic" in name for name in names)
    assert any(item.added_mass is not None and not item.fits_campaign for item in tests)
    advice = rank_tests(make_candidates(), tests, SOURCES)
    assert advice is not None
    best = advice.best
    most = max(item.probability for item in advice.ranked)
    assert best.probability >= most - 0.05
    alike = [item for item in advice.ranked if item.probability >= most - 0.05]
    assert best.test.minutes == min(item.test.minutes for item in alike)
    assert best.curve is not None
    # Another resonance moves the masses in another shape: the same tests tell less.
    again = next(item for item in advice.ranked if item.test.name == "the same tests again" and not item.test.place)
    others = [item for item in advice.ranked if "resonance near" in item.test.name]
    assert max(item.separation[0, 1] for item in others) > 1.3 * again.separation[0, 1]


def test_places_are_offered_once_and_without_a_sensor() -> None:
    assert set(PLACES) == {"m0", "m1", "m2"}
    points = TEST.make_points()
    assert set(points.sensor.tolist()) == {"at m2", "further sensor at m1"}
    assert len(points) == 2 * len(TEST.frequencies)
    # A sensor, and states twice at ten seconds.
    assert TEST.minutes == pytest.approx(10 + len(TEST.frequencies) * 2 / 6)
