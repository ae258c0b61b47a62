"""The bench's beam against beam theory and its own unreduced model."""

import numpy as np
import pytest

from fe.dense_modes import compute_dense_modes
from transient.virtual_bench.beam import (
    DENSITY,
    LENGTH,
    PLACES,
    STATIONS,
    THICKNESS,
    WIDTH,
    YOUNGS_MODULUS,
    BeamParameters,
    compute_station_shares,
    compute_stuck_angular_frequencies,
    contacts,
    full_beam,
    jointed_beam,
    reduced_beam,
)
from transient.virtual_bench.effect import HiddenEffect, insert_effect

DRAWN = BeamParameters()


def test_free_frequencies_equal_the_clamped_beam() -> None:
    # Roots of 1 + cos x cosh x = 0; 60 cubic elements are off by about (x / 60)^4 / 1440.
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    inertia, line_mass = WIDTH * THICKNESS**3 / 12, DENSITY * WIDTH * THICKNESS
    exact = (roots / LENGTH) ** 2 * np.sqrt(YOUNGS_MODULUS * inertia / line_mass)
    beam = full_beam()
    result = 2 * np.pi * compute_dense_modes(beam.mass, beam.stiffness).frequency[:3]
    np.testing.assert_allclose(result, exact, rtol=1e-6)


def test_a_tip_force_bends_the_reduced_beam_as_the_exact_cantilever() -> None:
    beam = reduced_beam()
    bend = np.linalg.solve(beam.stiffness, beam.places["tip"])
    stiffness = YOUNGS_MODULUS * WIDTH * THICKNESS**3 / 12
    for name, x in PLACES.items():
        # Cubic shapes hold the exact static deflection, so only round-off is left.
        assert beam.places[name] @ bend == pytest.approx(x**2 * (3 * LENGTH - x) / (6 * stiffness), rel=1e-9)


def test_the_reduction_keeps_frequencies_and_third_harmonics() -> None:
    full, reduced = full_beam(), reduced_beam()
    assert len(reduced.mass) < 25
    # A hundredth of the frequency jitter of the bench would be 3e-6.
    np.testing.assert_allclose(
        compute_stuck_angular_frequencies(reduced, DRAWN)[:4],
        compute_stuck_angular_frequencies(full, DRAWN)[:4],
        rtol=1e-6,
    )
    for omega in 2 * np.pi * 472.0 * np.array([1.0, 3.0]):
        responses = []
        for beam in (full, reduced):
            system = jointed_beam(beam, DRAWN)
            stiffness = system.stiffness + sum(
                joint.tangential_stiffness * joint.tangents.T @ joint.tangents
                + joint.normal_stiffness * np.outer(joint.normal, joint.normal)
                for joint in contacts(beam, DRAWN)
            )
            dynamic = stiffness - omega**2 * system.mass + 1j * omega * system.damping
            answer = np.linalg.solve(dynamic, system.dynamic[1])
            responses.append([row @ answer for row in beam.places.values()])
        np.testing.assert_allclose(responses[1], responses[0], rtol=1e-5)


@pytest.mark.parametrize("stations", [STATIONS, (0.2004, 0.2097, 0.2201), (0.2, 0.205, 0.21, 0.215, 0.22)])
def test_stations_share_the_line_and_its_moments(stations: tuple[float, ...]) -> None:
    x = np.array(stations)
    shares, along = compute_station_shares(x), (x - 0.21) / 0.02
    assert shares.sum() == pytest.approx(1.0, rel=1e-14)
    # Round-off of the solution.
    assert shares @ along == pytest.approx(0.0, abs=1e-14)
    assert shares @ along**2 == pytest.approx(1 / 12, rel=1e-12)


def test_the_flanks_slide_alike_and_close_oppositely() -> None:
    beam = reduced_beam()
    joints = contacts(beam, DRAWN)
    left, right = joints[1], joints[4]
    sine, cosine, height = 0.5, np.sqrt(0.75), 0.005
    slide = cosine * beam.deflection[1] - sine * height * beam.slope[1]
    close = sine * beam.deflection[1] + cosine * height * beam.slope[1]
    # Round-off of rows of size one to a hundred.
    np.testing.assert_allclose([left.tangents[0], right.tangents[0]], [slide, slide], atol=1e-11)
    np.testing.assert_allclose([left.normal, right.normal], [close, -close], atol=1e-11)
    assert [joint.gap for joint in joints] == pytest.approx([0] * 3 + [0, 0.5e-6, 1e-6])
    assert sum(joint.preload for joint in joints) == pytest.approx(48.0)


def test_a_small_mass_shifts_the_free_frequency_as_rayleighs_quotient_says() -> None:
    beam, mass = reduced_beam(), 1e-5
    _, free = insert_effect(beam, DRAWN, HiddenEffect(kind="mass", place="tip", strength=mass))
    before, after = (compute_dense_modes(item, beam.stiffness).frequency[0] for item in (beam.mass, free.mass))
    # First mode of a cantilever: phi(L)^2 = 4 / (beam mass). The next order is the square of the shift, 1e-9.
    shift = -mass * 4 / (DENSITY * WIDTH * THICKNESS * LENGTH) / 2
    assert (after - before) / before == pytest.approx(shift, rel=2e-4)
