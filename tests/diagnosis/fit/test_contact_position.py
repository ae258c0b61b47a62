"""Contacts that bear nearer to the middle: rows follow, sums and moments stay, and the bench's own stations agree."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.model import Model
from diagnosis.effect.preload import Preload
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.fit.contact_position import SHARED, find_contact_position_bounds, with_contact_position
from reduction.jointed_system import FrictionContact, JointedSystem
from study.beam.model import LINE_ENDS, beam_model
from transient.virtual_bench.beam import STATIONS, BeamParameters, contacts, full_beam

MIDDLE = sum(LINE_ENDS) / 2


@pytest.fixture(scope="module")
def beam() -> Model:
    return beam_model()


def members(model: Model, line: str) -> list[FrictionContact]:
    return [model.contact(name) for name in model.lines[line]]


def values(model: Model, line: str, name: str) -> NDArray[np.float64]:
    return np.array([getattr(contact, name) for contact in members(model, line)])


def stuck_frequencies(system: JointedSystem) -> NDArray[np.float64]:
    stiffness = np.array(system.stiffness)
    for joint in system.joints:
        assert isinstance(joint, FrictionContact)
        stiffness += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
        stiffness += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
    return np.sqrt(eigh(stiffness, system.mass, eigvals_only=True)) / (2 * np.pi)


def test_a_factor_of_one_changes_nothing(beam: Model) -> None:
    assert with_contact_position(beam, 1.0) is beam
    # What takes the way through all formulae ends at the same numbers: round-off.
    for before, after in zip(beam.system.joints, with_contact_position(beam, 1 + 1e-13).system.joints, strict=True):
        for name in (*SHARED, "gap", "normal", "tangents"):
            was, now = (np.atleast_1d(getattr(contact, name)) for contact in (before, after))
            # Gaps are of the order of 1e-6 m.
            np.testing.assert_allclose(now, was, rtol=0, atol=1e-11 * max(np.abs(was).max(), 1e-6))


@pytest.mark.parametrize("factor", [0.8, 0.95, 1.1])
@pytest.mark.parametrize("n_station", [3, 5])
def test_sums_balance_and_moments_of_inertia_are_kept(n_station: int, factor: float) -> None:
    before = beam_model(n_station=n_station)
    after, place = with_contact_position(before, factor), np.linspace(-1, 1, n_station)
    for line in before.lines:
        for name in SHARED:
            was, now = values(before, line, name), values(after, line, name)
            # Round-off.
            assert now.sum() == pytest.approx(was.sum(), rel=1e-13)
            assert now @ place == pytest.approx(0.0, abs=1e-13 * was.sum())
            assert now @ (factor * place) ** 2 == pytest.approx(was @ place**2, rel=1e-13)
            assert not np.allclose(now, was, rtol=1e-2)


def test_a_line_that_is_loaded_on_one_side_keeps_its_own_middle(beam: Model) -> None:
    shares = {"left.1": 1.0, "left.2": 3.0, "left.3": 2.0}
    lopsided = beam.with_joints({name: {"normal_stiffness": 1e6 * share} for name, share in shares.items()})
    was = values(lopsided, "left", "normal_stiffness")
    place = np.linspace(-1, 1, 3)
    place = place - was @ place / was.sum()
    now = values(with_contact_position(lopsided, 0.9), "left", "normal_stiffness")
    # Round-off. About the middle of what they carry, so that the line neither moves nor turns.
    assert now @ place == pytest.approx(0.0, abs=1e-13 * was.sum())
    assert now @ (0.9 * place) ** 2 == pytest.approx(was @ place**2, rel=1e-13)


def test_rows_and_gaps_are_those_of_the_places_between(beam: Model) -> None:
    """w and w' are cubic within an element, so that a parabola through three stations is off by h^3 w''' / 15 or so."""
    factor = 0.95
    closer = with_contact_position(beam, factor)
    stations = tuple(MIDDLE + factor * (x - MIDDLE) for x in STATIONS)
    own = full_beam(stations=stations)
    drawn = np.linalg.solve(beam.system.stiffness, beam.places["tip"])
    exact = np.linalg.solve(own.stiffness, own.places["tip"])
    for contact, bench, line in zip(
        closer.system.joints, contacts(own, BeamParameters()), beam.system.joints, strict=True
    ):
        for name in ("normal", "tangents"):
            result, wanted, was = (
                float(np.squeeze(getattr(joint, name) @ shape))
                for joint, shape in ((contact, drawn), (bench, exact), (line, drawn))
            )
            # Under a tip force w is a cubic; the left station moves by 0.4 % of w, the parabola leaves a thousandth.
            assert result == pytest.approx(wanted, rel=1e-5)
            if not line.name.endswith(".2"):
                assert was != pytest.approx(wanted, rel=3e-3)
        # Linear along the line.
        assert contact.gap == pytest.approx(bench.gap, abs=1e-18)


@pytest.mark.parametrize("factor", [0.93, 0.98, 1.04])
def test_it_agrees_with_a_bench_whose_stations_lie_there(beam: Model, factor: float) -> None:
    own = full_beam(stations=tuple(MIDDLE + factor * (x - MIDDLE) for x in STATIONS))
    closer = with_contact_position(beam, factor)
    for contact, bench in zip(closer.system.joints, contacts(own, BeamParameters()), strict=True):
        for name in SHARED:
            # The bench solves for the moments of a uniform line; round-off.
            assert getattr(contact, name) == pytest.approx(getattr(bench, name), rel=1e-12)


def test_the_stuck_structure_keeps_its_frequencies(beam: Model) -> None:
    drawn = stuck_frequencies(beam.system)
    closer = stuck_frequencies(with_contact_position(beam, 0.95).system)
    naive = with_contact_position(beam, 0.95)
    naive = naive.with_joints(
        {name: {item: getattr(beam.contact(name), item) for item in SHARED} for name in sum(beam.lines.values(), ())}
    )
    lost = stuck_frequencies(naive.system)
    # Sum and moment of inertia hold the first modes; what is left is the fourth moment of a line of 20 mm in a mode of
    # 300 mm. Moved without new shares, 10 % of the moment of inertia is lost, and with it the second frequency.
    np.testing.assert_allclose(closer[:4], drawn[:4], rtol=2e-5)
    assert np.abs(lost[:4] / drawn[:4] - 1).max() > 20 * np.abs(closer[:4] / drawn[:4] - 1).max()


def test_rest_stays_rest(beam: Model) -> None:
    """The static load balances the preloads of the contacts where they bear; the two lines alone would cancel."""
    harder = Preload(name="left", target="left").apply(beam, [1.5])
    for factor in (0.9, 1.1):
        closer = with_contact_position(harder, factor).system
        balance = sum(joint.preload * joint.normal for joint in closer.joints if isinstance(joint, FrictionContact))
        # Round-off of 20 N.
        np.testing.assert_allclose(closer.static, balance, rtol=0, atol=1e-13 * 24)


def test_another_static_load_stays(beam: Model) -> None:
    own_weight = beam.with_system(static_load=beam.system.static + 2 * beam.places["tip"])
    change = with_contact_position(own_weight, 0.9).system.static - with_contact_position(beam, 0.9).system.static
    np.testing.assert_allclose(change, 2 * beam.places["tip"], rtol=0, atol=1e-12)


def test_lines_of_two_contacts_and_free_structures_are_left_alone(small: Model) -> None:
    for model in (small, small.without_contacts()):
        closer = with_contact_position(model, 0.9).system
        for before, after in zip(model.system.joints, closer.joints, strict=True):
            assert before is after
        np.testing.assert_array_equal(closer.static, model.system.static)


def given(model: Model) -> CalibrationParameter:
    (result,) = (
        item for item in list_calibration_parameters(model, deviation={"bearing": 0.05}) if item.name == "bearing"
    )
    return result


def test_it_is_accepted_where_a_line_has_three_contacts_and_a_prior(beam: Model, small: Model) -> None:
    assert "bearing" not in [item.name for item in list_calibration_parameters(beam)]
    assert given(beam).deviation == 0.05
    assert "bearing" not in [item.name for item in list_calibration_parameters(small, deviation={"bearing": 0.05})]
    assert values(given(beam).apply(beam, [0.9]), "left", "preload")[0] == pytest.approx(4 / 0.81)


def test_its_bounds_leave_a_finer_model_possible(beam: Model) -> None:
    finer = beam_model(n_station=5)
    (alone,), (both,) = (
        [
            item.parameters[0]
            for item in list_calibration_parameters(beam, deviation={"bearing": 0.1}, finer=models)
            if item.name == "bearing"
        ]
        for models in ([], [finer])
    )
    assert (both.lower, both.upper) == find_contact_position_bounds(finer, alone.lower, alone.upper)
    assert alone.lower < both.lower


@pytest.mark.parametrize("shares", [(1, 4, 1), (1, 2, 1), (1, 1, 1), (3, 1, 3), (1, 4, 2, 4, 1)])
def test_within_its_bounds_every_contact_carries_something(shares: tuple[int, ...]) -> None:
    model = beam_model(n_station=len(shares))
    share = np.array(shares) / sum(shares)
    change = {}
    for names in model.lines.values():
        for name, part in zip(names, share, strict=True):
            change[name] = {"tangential_stiffness": 3e6 * part, "normal_stiffness": 4e6 * part, "preload": 24 * part}
    model = model.with_joints(change)
    (factor,) = given(model).parameters
    assert 0.5 <= factor.lower < 1 < factor.upper <= 1.5
    for end in (factor.lower, factor.upper):
        for line in model.lines:
            for name in SHARED:
                assert (values(with_contact_position(model, end), line, name) > 0.05 * values(model, line, name)).all()


def test_bounds_are_no_tighter_than_they_must_be() -> None:
    """Three equal shares s keep 2 s at +- f: the ends get s / f^2, the middle has 3 s - 2 s / f^2 left."""
    model = beam_model()
    equal = model.with_joints(
        {joint.name: {"tangential_stiffness": 1e6, "normal_stiffness": 1e6, "preload": 8.0}
         for joint in model.system.joints}
    )  # fmt: skip
    lower, upper = find_contact_position_bounds(equal, 0.5, 1.5)
    # A tenth of s is left: f^2 = 2 / 2.9.
    assert lower == pytest.approx((2 / 2.9) ** 0.5)
    assert upper == 1.5
    # A line of two contacts is left alone.
    two = replace(equal, sensors=(), lines={"left": model.lines["left"][:2]}, linked_preloads=())
    assert find_contact_position_bounds(two, 0.5, 1.5) == (0.5, 1.5)
