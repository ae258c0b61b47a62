"""Bodies reduced by themselves and joined by springs, against one reduction-free model of the whole."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from geometry.interface import ContactLine
from reduction.assembly import ReducedAssembly, reduce_bodies, select_lowest_modes, truncated
from reduction.errors import JointError, RomError
from reduction.line_contact import (
    LineStiffness,
    Tangents,
    compute_station_stiffness,
    make_contact_directions,
    make_fixed_tangent_stiffness,
    make_line_contacts,
)
from reduction.stuck import stuck_stiffness
from tests.reduction.two_bodies import Whole, line_on_block, nearest

SPRINGS = LineStiffness(normal=8e6, tangential=5e6)


@pytest.fixture(scope="module")
def line() -> ContactLine:
    return line_on_block()


@pytest.fixture(scope="module")
def whole(line: ContactLine) -> Whole:
    return Whole(line)


@pytest.fixture(scope="module")
def reduced(whole: Whole) -> ReducedAssembly:
    return reduce_bodies(whole.systems, whole.boundary, 24)


def directions_of(reduced: ReducedAssembly, line: ContactLine) -> NDArray[np.float64]:
    rows = (reduced.rows(body, "contact").reshape(-1, 3) for body in ("block", "beam"))
    return np.asarray(make_contact_directions(reduced.n_dof, line, *rows))


def stuck(line: ContactLine, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    contacts = make_line_contacts("pair", line, directions, SPRINGS, 0.6)
    return np.asarray(stuck_stiffness(make_fixed_tangent_stiffness(line, directions, SPRINGS), contacts))


def test_stuck_frequencies_are_those_of_the_whole(whole: Whole, reduced: ReducedAssembly, line: ContactLine) -> None:
    # The block hangs on its springs alone: three stations in one line leave it a rotation about that line.
    expected = whole.frequencies(stuck(line, whole.directions), 6)
    springs = stuck(line, directions_of(reduced, line))
    lambda_ = scipy.linalg.eigh(reduced.stiffness + springs, reduced.mass, eigvals_only=True)[:6]
    result = np.sqrt(lambda_.clip(min=0)) / (2 * np.pi)
    assert result[0] < 1  # round-off of a squared frequency that is zero, beside 1e10
    # Above, and by the square of the ratio to the first mode that is left out.
    assert (result[1:] > expected[1:] * (1 - 1e-9)).all()
    np.testing.assert_allclose(result[1:], expected[1:], rtol=1e-4)


def test_modes_are_the_lowest_of_all_bodies(whole: Whole, reduced: ReducedAssembly) -> None:
    every = {body: reduce_bodies({body: system}, {body: whole.boundary[body]}, {body: 24})
             for body, system in whole.systems.items()}  # fmt: skip
    frequency = np.sort(np.concatenate([item.bodies[b].fixed_interface_frequency for b, item in every.items()]))
    kept = np.concatenate([rom.fixed_interface_frequency for rom in reduced.bodies.values()])
    np.testing.assert_allclose(np.sort(kept), frequency[:24], rtol=1e-9)
    assert reduced.n_dof == 24 + 9 + 12
    # The block is short and stiff: the beam has most of them, though not all.
    n_beam = len(reduced.bodies["beam"].fixed_interface_frequency)
    assert 12 < n_beam < 24


def test_numbers_of_modes_may_be_given_for_each_body(whole: Whole) -> None:
    made = reduce_bodies(whole.systems, whole.boundary, {"beam": 5, "block": 2})
    assert {body: len(rom.fixed_interface_frequency) for body, rom in made.bodies.items()} == {"beam": 5, "block": 2}
    with pytest.raises(RomError, match=r"numbers of modes are given for beam, but the bodies are beam, block"):
        reduce_bodies(whole.systems, whole.boundary, {"beam": 5})


def test_a_truncated_model_is_one_reduced_with_fewer_modes(whole: Whole) -> None:
    few, many = (
        reduce_bodies({"beam": whole.systems["beam"]}, {"beam": whole.boundary["beam"]}, {"beam": n}).bodies["beam"]
        for n in (4, 9)
    )
    cut = truncated(many, 4)
    np.testing.assert_allclose(cut.modes(4).frequency, few.modes(4).frequency, rtol=1e-10)
    assert cut.recovery.shape == few.recovery.shape
    with pytest.raises(RomError, match=r"10 modes were requested from a reduced model with 9"):
        truncated(many, 10)
    assert select_lowest_modes({"a": many, "b": many}, 3)["a"].n_dof in {many.n_boundary + 1, many.n_boundary + 2}


def test_fields_of_all_bodies_come_back(whole: Whole, reduced: ReducedAssembly, line: ContactLine) -> None:
    rng = np.random.default_rng(1)
    q = rng.standard_normal(reduced.n_dof) + 1j * rng.standard_normal(reduced.n_dof)
    fields = reduced.displacement(q)
    for body, mesh in whole.meshes.items():
        assert fields[body].shape == (mesh.n_node, 3)
        nodes = nearest(mesh, line.stations)
        np.testing.assert_allclose(fields[body][nodes].ravel(), q[reduced.rows(body, "contact")], rtol=1e-12)
    on_both = reduced.on_whole_mesh(np.column_stack([q, 2 * q]))
    beam = fields["beam"]
    np.testing.assert_allclose(on_both[0], np.concatenate([beam, fields["block"]]), rtol=1e-12)
    np.testing.assert_allclose(on_both[1, : len(beam)], 2 * beam, rtol=1e-12)
    with pytest.raises(RomError, match=r"its first axis must be the 45 coordinates"):
        reduced.displacement(q[:-1])
    with pytest.raises(RomError, match=r'has no body "blok": it has beam, block'):
        reduced.rows("blok", "contact")


def test_a_body_that_its_boundary_does_not_hold_is_named(whole: Whole) -> None:
    boundary = {**whole.boundary, "block": {"contact": whole.boundary["block"]["contact"]}}
    with pytest.raises(RomError, match=r"^block: the \d+ interior degrees of freedom can still move as a rigid body"):
        reduce_bodies(whole.systems, boundary, 10)


def test_stiffness_is_shared_by_length_and_adds_up(line: ContactLine) -> None:
    shares = compute_station_stiffness(line, SPRINGS)
    np.testing.assert_allclose(shares.sum(axis=0), [8e6, 5e6], rtol=1e-14)
    np.testing.assert_allclose(shares[:, 0], [2e6, 4e6, 2e6], rtol=1e-14)
    with pytest.raises(JointError, match=r"the normal stiffness of a contact line is -1 N/m: give a positive number"):
        LineStiffness(normal=-1.0, tangential=1.0)


def test_rigid_approach_and_sliding_read_as_such(whole: Whole, line: ContactLine) -> None:
    block = np.zeros(whole.n_dof)
    start = whole.systems["beam"].n_dof
    block[start + 2 :: 3] = -1e-6  # the block comes down by 1 um
    np.testing.assert_allclose(whole.directions[:, 0] @ block, 1e-6, rtol=1e-12)
    np.testing.assert_allclose(whole.directions[:, 1:] @ block, 0, atol=1e-20)
    block[:] = 0
    block[start::3] = 2e-6
    np.testing.assert_allclose(whole.directions[:, 1] @ block, 2e-6, rtol=1e-12)
    np.testing.assert_allclose(whole.directions[:, 2] @ block, 0, atol=1e-20)


def test_contacts_and_held_tangents_make_up_what_sticks(whole: Whole, line: ContactLine) -> None:
    normal, along, across = np.moveaxis(whole.directions, 1, 0)
    k_n, k_t = compute_station_stiffness(line, SPRINGS).T
    expected = sum(rows.T @ (k[:, None] * rows) for rows, k in ((normal, k_n), (along, k_t), (across, k_t)))
    for tangents in Tangents:
        contacts = make_line_contacts("pair", line, whole.directions, SPRINGS, 0.6, tangents=tangents)
        assert [contact.name for contact in contacts] == ["pair.1", "pair.2", "pair.3"]
        total = np.zeros_like(expected)
        for contact in contacts:
            total += contact.normal_stiffness * np.outer(contact.normal, contact.normal)
            total += contact.tangential_stiffness * contact.tangents.T @ contact.tangents
        if tangents is Tangents.ALONG:
            assert contacts[0].tangents.shape[0] == 1
            total += make_fixed_tangent_stiffness(line, whole.directions, SPRINGS)
        np.testing.assert_allclose(total, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(stuck(line, whole.directions), expected, atol=1e-9 * np.abs(expected).max())


def test_gaps_are_one_a_station(whole: Whole, line: ContactLine) -> None:
    contacts = make_line_contacts("pair", line, whole.directions, SPRINGS, 0.6, gaps=[0.0, 1e-6, 2e-6])
    assert [contact.gap for contact in contacts] == [0.0, 1e-6, 2e-6]
    with pytest.raises(JointError, match=r'"pair" has 3 stations but gaps of shape \(2,\): give one per station'):
        make_line_contacts("pair", line, whole.directions, SPRINGS, 0.6, gaps=[0.0, 1.0])


def test_an_assembly_needs_a_body() -> None:
    with pytest.raises(RomError, match="an assembly without bodies is empty"):
        ReducedAssembly(bodies={})


def test_damping_comes_along(whole: Whole) -> None:
    beam = whole.systems["beam"]
    damped = replace(beam, damping=sp.csr_array(2.0 * beam.mass))
    made = reduce_bodies({"beam": damped}, {"beam": whole.boundary["beam"]}, 3)
    np.testing.assert_allclose(made.damping, 2.0 * made.mass, atol=1e-9 * np.abs(made.mass).max())
