"""What sensors and joint directions see of a structure, against the response of all its degrees of freedom."""

import numpy as np
import pytest

from hbsolve.condensed import CondensedStructure

N, HARMONICS, SEVERAL = 9, 4, (1.3, 0.7, 2.1)


def structure(damping: str) -> CondensedStructure:
    """Masses on springs with joints in three directions, damped so that modes with joints, without, or none fit.

    Gyroscopic damping is not symmetric, so that a force and what it moves cannot change places.
    """
    random = np.random.default_rng(5)
    mass, spring = np.diag(random.uniform(0.5, 2.0, N)), random.standard_normal((N, N))
    stiffness = spring @ spring.T + np.eye(N)
    directions, reference = random.standard_normal((3, N)), np.array([2.0, 0.5, 3.0])
    match damping:
        case "stuck":
            C = 0.01 * (stiffness + directions.T @ (reference[:, None] * directions))
        case "free":
            C = 0.01 * stiffness
        case "gyroscopic":
            C = 0.01 * stiffness + np.triu(spring, 1) - np.triu(spring, 1).T
        case _:
            C = 0.01 * stiffness + np.diag(random.uniform(0.1, 1.0, N))
    force = random.standard_normal((2, HARMONICS, N)) * (np.arange(HARMONICS) > 0)[:, None]
    static = np.zeros((HARMONICS, N), dtype=np.complex128)
    static[0] = random.standard_normal(N)
    return CondensedStructure(
        mass=mass, damping=C, stiffness=stiffness, directions=directions, reference=reference, static=static,
        dynamic=force[0] + 1j * force[1],
    )  # fmt: skip


@pytest.mark.parametrize("damping", ["stuck", "free", "gyroscopic", "none"])
def test_directions_and_sensors_see_the_response(damping: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # Two groups of Omega: one of them takes 16 bytes for each of 4 responses, harmonic and degree of freedom.
    monkeypatch.setattr("hbsolve.condensed.CHUNK_SIZE", 2 * 16 * 4 * HARMONICS * N)
    own = structure(damping)
    assert own.is_dense == (damping in {"gyroscopic", "none"})
    several, rows = own.at_each(SEVERAL), np.random.default_rng(6).standard_normal((2, N))
    stuck = own.stiffness + own.directions.T @ (own.reference[:, None] * own.directions)
    for omega, condensed, (dynamic, contact) in zip(SEVERAL, several, own.recover_rows(several, rows), strict=True):
        assert condensed.angular_frequency == omega
        for k in range(HARMONICS):
            alpha = np.linalg.inv(stuck - (k * omega) ** 2 * own.mass + 1j * k * omega * own.damping)
            # Round-off: the condition of these matrices is below 1e3.
            np.testing.assert_allclose(condensed.receptance[k], own.directions @ alpha @ own.directions.T, atol=1e-11)
            np.testing.assert_allclose(contact[k], rows @ alpha @ own.directions.T, atol=1e-11)
            np.testing.assert_allclose(dynamic[k], rows @ alpha @ own.dynamic[k], atol=1e-11)


@pytest.mark.parametrize("damping", ["stuck", "free", "gyroscopic", "none"])
def test_full_responses_at_several_frequencies_are_those_of_the_matrices(
    damping: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hbsolve.condensed.CHUNK_SIZE", 2 * 16 * 4 * HARMONICS * N)
    own, random = structure(damping), np.random.default_rng(7)
    several = own.at_each(SEVERAL)
    forces = random.standard_normal((5, HARMONICS, N)) + 1j * random.standard_normal((5, HARMONICS, N))
    stuck = own.stiffness + own.directions.T @ (own.reference[:, None] * own.directions)
    moved, recoveries = own.displacements_at_each(several, forces), own.recoveries(several)
    # One force at each frequency, in the same order: round-off, as above.
    at_own = own.displacements_at_own_frequency(several[:5], forces[: len(several)])
    for motion, item, number in zip(moved, at_own, range(5), strict=False):
        np.testing.assert_allclose(item, motion[number], atol=1e-11)
    for omega, motion, recovery in zip(SEVERAL, moved, recoveries, strict=True):
        for k in range(HARMONICS):
            alpha = np.linalg.inv(stuck - (k * omega) ** 2 * own.mass + 1j * k * omega * own.damping)
            np.testing.assert_allclose(motion[:, k], forces[:, k] @ alpha.T, atol=1e-11)  # round-off, as above
            np.testing.assert_allclose(recovery.contact[k], alpha @ own.directions.T, atol=1e-11)
            np.testing.assert_allclose(recovery.dynamic[k], alpha @ own.dynamic[k], atol=1e-11)
