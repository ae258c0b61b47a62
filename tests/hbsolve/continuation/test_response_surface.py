"""The force surface and its contours against closed forms and against curves under constant force."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.response_surface import response_surface
from hbsolve.continuation.surface import ResponseSurface, load_surface
from hbsolve.errors import BalanceError
from reduction.jointed_system import CubicSpring, JointedSystem
from tests.hbsolve.continuation.test_controlled_response import friction_chain
from tests.hbsolve.continuation.test_response import duffing
from tests.slow import slow

OMEGA, AMPLITUDE = np.linspace(0.8, 2.0, 61), np.geomspace(0.02, 1.0, 21)


@pytest.fixture(scope="module")
def surface() -> ResponseSurface:
    """Of the Duffing oscillator with one harmonic and 3 % damping."""
    return response_surface(duffing(zeta=0.03, n_harmonic=2), 0, OMEGA, AMPLITUDE)


def duffing_force(omega: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Complex level over the reading, times its amplitude."""
    return (1 + 0.75 * a**2 - omega**2 + 0.06j * omega) * a / 0.01


def test_level_and_phase_are_those_of_the_duffing_oscillator(surface: ResponseSurface) -> None:
    exact = duffing_force(OMEGA, AMPLITUDE[:, None])
    np.testing.assert_allclose(surface.level * np.exp(-1j * surface.phase), exact, rtol=1e-11)  # round-off


@pytest.mark.parametrize("level", [1.5, 6.0, pytest.param(0.3, marks=slow)])
def test_a_contour_is_the_response_at_that_level(surface: ResponseSurface, level: float) -> None:
    (contour,) = surface.at_level(level)
    # In the valley the force within a cell of the finer grid is no plane.
    exact = np.abs(duffing_force(contour.angular_frequency, contour.amplitude))
    np.testing.assert_allclose(exact, level, rtol=1e-2)
    coarse = surface.at_level(level, fine=6)[0]
    worse = np.abs(np.abs(duffing_force(coarse.angular_frequency, coarse.amplitude)) / level - 1).max()
    assert worse > 4 * np.abs(exact / level - 1).max()  # second order: 16 times by a quarter of the cell


def test_a_contour_has_the_unstable_part_between_the_folds(surface: ResponseSurface) -> None:
    (contour,) = surface.at_level(6.0)
    crossings = np.diff(np.sign(contour.angular_frequency - 1.15)) != 0
    a = np.sort(contour.amplitude[1:][crossings])
    below = 1 - 1.15**2
    squares = np.roots([0.75**2, 2 * 0.75 * below, below**2 + (0.06 * 1.15) ** 2, -(0.06**2)])
    exact = np.sqrt(np.sort(squares[np.abs(squares.imag) < 1e-9].real))
    assert len(exact) == 3
    np.testing.assert_allclose(a, exact, rtol=2e-2)  # the cell of the finer grid in which it passes


@pytest.fixture(scope="module")
def chained() -> tuple[HarmonicBalance, ResponseSurface]:
    """A chain with contacts, and a surface of it."""
    balance = friction_chain("coupled")
    return balance, response_surface(balance, 4, np.linspace(6.0, 10.0, 31), np.geomspace(0.04, 0.4, 14))


@pytest.mark.parametrize("level", [1.0, pytest.param(0.5, marks=slow), pytest.param(2.0, marks=slow)])
def test_contours_pass_through_the_response_of_contacts_at_that_level(
    chained: tuple[HarmonicBalance, ResponseSurface], level: float
) -> None:
    balance, surface = chained
    assert np.isfinite(surface.level).all()
    curve = frequency_response(balance.at_level(level), 6.0, 10.0)
    within = (curve.amplitude(4) > surface.amplitude[0]) & (curve.amplitude(4) < surface.amplitude[-1])
    points = np.column_stack([curve.angular_frequency / 8, np.log(curve.amplitude(4))])[within]
    contours = [
        np.column_stack([item.angular_frequency / 8, np.log(item.amplitude)]) for item in surface.at_level(level)
    ]
    distance = [min(float(np.linalg.norm(item - point, axis=1).min()) for item in contours) for point in points]
    # Kinks of contacts lie between amplitudes that are 20 % apart: the spline is wrong by a twentieth of that there.
    assert max(distance) < 0.015
    assert np.median(distance) < 0.002


def test_a_surface_survives_its_file_and_is_a_table(surface: ResponseSurface, tmp_path: Path) -> None:
    surface.save(tmp_path / "surface.nc")
    read = load_surface(tmp_path / "surface.nc")
    for name in ("angular_frequency", "amplitude", "level", "phase", "other_frequency", "other_amplitude"):
        assert getattr(read, name).dtype == getattr(surface, name).dtype
        np.testing.assert_array_equal(getattr(read, name), getattr(surface, name))
    assert read.derivative == surface.derivative
    table = surface.to_pandas()
    assert len(table) == surface.level.size
    np.testing.assert_array_equal(table["level [-]"], surface.level.ravel())
    assert surface.to_xarray().amplitude.attrs["units"] == "m"
    surface.save_matlab(tmp_path / "surface.mat")
    with pytest.raises(BalanceError, match="surface"):
        load_surface(tmp_path / "surface.mat")


def test_an_acceleration_is_that_of_the_displacement() -> None:
    balance, omega = duffing(zeta=0.03, n_harmonic=2), np.linspace(1.0, 1.2, 3)
    surface = response_surface(balance, 0, omega, [0.2, 0.4], derivative=2)
    for row, held in zip(surface.level, (0.2, 0.4), strict=True):
        np.testing.assert_allclose(row, np.abs(duffing_force(omega, held / omega**2)), rtol=1e-9)  # solved to it
    assert next(iter(surface.to_pandas())) == "amplitude [m/s^2]"


def test_a_contour_stops_at_what_was_not_found(surface: ResponseSurface) -> None:
    level = np.array(surface.level)
    level[:, 5:7] = np.nan
    pieces = replace(surface, level=level).at_level(1.5)
    assert len(pieces) == 2
    for contour in pieces:
        beside = (contour.angular_frequency <= OMEGA[4] + 1e-9) | (contour.angular_frequency >= OMEGA[7] - 1e-9)
        assert beside.all()


@slow
def test_sheets_that_do_not_belong_together_have_no_contours_between_them() -> None:
    # Detroux, Habib, Masset and Kerschen (2015): with an absorber several states have one amplitude of the mass.
    k, c = 0.04535, 0.01276
    system = JointedSystem(
        mass=np.diag([1.0, 0.05]),
        damping=[[0.002 + c, -c], [-c, c]],
        stiffness=[[1 + k, -k], [-k, k]],
        joints=[
            CubicSpring(name="ground", direction=np.array([1.0, 0.0]), stiffness=1.0),
            CubicSpring(name="absorber", direction=np.array([1.0, -1.0]), stiffness=0.004167),
        ],
        harmonic_force=[[0, 0], [1.0, 0]],
    )
    balance, amplitude = HarmonicBalance(system=system, n_harmonic=4), np.geomspace(0.1, 2.0, 21)
    surface = response_surface(balance, 0, np.linspace(0.6, 1.6, 51), amplitude)
    assert surface.other_amplitude.any()
    # 0.11 N has no isola: all that is drawn lies on the curve, within a share of the cells, 2 % and 16 % wide.
    curve = frequency_response(balance.at_level(0.11), 0.6, 1.6, step=0.005)
    corners = np.column_stack([curve.angular_frequency, np.log(curve.amplitude(0))])
    number = np.arange(0, len(corners) - 1, 0.05)  # corners may be 20 % of the amplitude apart
    points = np.column_stack([np.interp(number, np.arange(len(corners)), entry) for entry in corners.T])
    contours = surface.at_level(0.11)
    assert sum(len(item.amplitude) for item in contours) > 100
    for item in contours:
        for point in np.column_stack([item.angular_frequency, np.log(item.amplitude)])[::5]:
            assert np.linalg.norm(points - point, axis=1).min() < 0.05


@pytest.mark.parametrize(
    ("omega", "amplitude", "match"),
    [
        ([1.0], [0.1], "angular_frequency"),
        ([1.0, 1.0], [0.1], "before 1"),
        ([1.0, 2.0], [0.2, 0.1], "amplitude has 0.2 before 0.1"),
        ([1.0, 2.0], [], "amplitude"),
        ([1.0, 2.0], [0.0, 0.1], "amplitude = 0"),
        ([1.0, np.inf], [0.1], "inf"),
    ],
)
def test_grids_that_do_not_ascend_are_refused(omega: list[float], amplitude: list[float], match: str) -> None:
    with pytest.raises(BalanceError, match=match):
        response_surface(duffing(n_harmonic=2), 0, omega, amplitude)


def test_levels_without_a_contour_are_refused(surface: ResponseSurface) -> None:
    for level, fine, match in ((0.0, 8, "level = 0"), (np.nan, 8, "nan"), (1.0, 0, "fine = 0")):
        with pytest.raises(BalanceError, match=match):
            surface.at_level(level, fine=fine)
    assert surface.at_level(1e9) == ()
