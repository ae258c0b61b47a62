"""A slip of a unit is doubted with its evidence; no structure that somebody may shake is."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from geometry.errors import InputWarning
from reduction.jointed_system import JenkinsElement, JointedSystem
from study.case.model_doubt import compute_natural_frequencies, doubt_frequency, doubt_sweep, warn_of_size
from study.case.setup import read_case
from study.shipped_cases import BEAM, LIMITS, SOLVE

Matrix = NDArray[np.float64]
N_RANDOM = 400
#: Moduli and densities of rubber, plastic, magnesium, steel and a ceramic [Pa, kg/m^3].
MATERIALS = ((5e6, 1100.0), (3e9, 1200.0), (45e9, 1740.0), (210e9, 7800.0), (400e9, 3900.0))


def beam(length: float, thickness: float, young: float, density: float, n: int = 8) -> tuple[Matrix, Matrix]:
    """A cantilever of square section in beam elements [kg, N/m]."""
    h, area, inertia = length / n, thickness**2, thickness**4 / 12
    one = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                    [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])  # fmt: skip
    two = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                    [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])  # fmt: skip
    mass, stiffness = np.zeros((2, 2 * n + 2, 2 * n + 2))
    for k in range(n):
        at = slice(2 * k, 2 * k + 4)
        stiffness[at, at] += young * inertia / h**3 * one
        mass[at, at] += density * area * h / 420 * two
    return mass, stiffness


def system_of(mass: Matrix, stiffness: Matrix, **more: object) -> JointedSystem:
    return JointedSystem(mass=mass, damping=0 * mass, stiffness=stiffness, **more)


def plausible(rng: np.random.Generator) -> tuple[Matrix, Matrix, float]:
    """A clamped or free beam of a random material, 2 mm to 25 m long and 3 to 300 times as long as thick."""
    young, density = MATERIALS[rng.integers(len(MATERIALS))]
    length = float(np.exp(rng.uniform(np.log(2e-3), np.log(25.0))))
    slenderness = float(np.exp(rng.uniform(np.log(3.0), np.log(300.0))))
    # Long and thin is a rope: nobody builds a beam that sags by more than its length.
    thickness = max(length / slenderness, (12 * density * 9.81 * length**3 / (8 * young)) ** 0.5)
    mass, stiffness = beam(length, thickness, young, density)
    clamped = slice(2 if rng.random() < 0.7 else 0, None)
    return mass[clamped, clamped], stiffness[clamped, clamped], length


def test_no_plausible_structure_is_doubted() -> None:
    rng = np.random.default_rng(11)
    for _ in range(N_RANDOM):
        mass, stiffness, length = plausible(rng)
        natural = compute_natural_frequencies(system_of(mass, stiffness))
        assert not doubt_frequency(natural[0]), (natural[0], length)
        # Somebody sweeps about one of the modes, from a tenth below it.
        about = natural[rng.integers(min(3, len(natural)))]
        assert not doubt_sweep(natural, 0.9 * about, 1.1 * about)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warn_of_size(length, 1e-3)


def test_rigid_motions_are_not_the_first_mode() -> None:
    mass, stiffness = beam(0.3, 0.01, 210e9, 7800.0)
    free = compute_natural_frequencies(system_of(mass, stiffness))
    # Free beam: (4.7300 / L)^2 sqrt(E t^2 / (12 rho)) / 2 pi; eight elements err by less than 1e-4.
    exact = (4.7300 / 0.3) ** 2 * (210e9 * 0.01**2 / (12 * 7800)) ** 0.5 / (2 * np.pi)
    assert free[0] == pytest.approx(exact, rel=1e-4)


def test_contacts_count_as_they_hold() -> None:
    rub = JenkinsElement(name="rub", direction=np.ones(1), tangential_stiffness=1e6, limit_force=1.0)
    held = compute_natural_frequencies(system_of(np.eye(1), np.zeros((1, 1)), joints=[rub]))
    assert held[0] == pytest.approx(1e3 / (2 * np.pi))


@pytest.mark.parametrize(
    ("factor", "word"),
    [
        (1e9, "kg/mm^3"),  # the mode at 0.0039 Hz
        (1e12, "mm, tonne, s"),
        (1e-12, "tonne/mm^3"),
    ],
)
def test_a_slip_of_the_density_is_asked_for(factor: float, word: str) -> None:
    mass, stiffness = beam(0.25, 0.01, 210e9, factor * 7800.0)
    natural = compute_natural_frequencies(system_of(mass[2:, 2:], stiffness[2:, 2:]))
    doubt = doubt_frequency(float(natural[0]))
    assert f"{natural[0]:.2g} Hz" in doubt
    assert f"{word}" in doubt
    assert doubt.endswith("?")


@pytest.mark.parametrize(("longest", "unit", "meant"), [(250.0, 1.0, "250 mm"), (2.5e-4, 1e-3, "0.25 m")])
def test_a_mesh_in_another_unit_is_asked_for(longest: float, unit: float, meant: str) -> None:
    with pytest.warns(InputWarning) as caught:
        warn_of_size(longest, unit)
    assert f'did you mean "{meant}"?' in str(caught[0].message)


@pytest.mark.parametrize(("first", "last"), [(0.01, 0.02), (0.02, 0.01), (1.0, 1.19)])
def test_a_sweep_far_below_all_modes_is_doubted_with_the_nearest(first: float, last: float) -> None:
    assert "120 Hz" in doubt_sweep(np.array([120.0, 800.0]), first, last)
    assert not doubt_sweep(np.array([120.0, 800.0]), first, 1.21)


@pytest.mark.parametrize("case", [BEAM, LIMITS, SOLVE], ids=lambda path: path.stem)
def test_shipped_cases_are_not_doubted(case: Path) -> None:
    from study.case.model_doubt import warn_of_model

    read = read_case(case)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_model(read.opened.case, read.model.system, swept=True)


def test_solve_names_line_and_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from study import cli

    monkeypatch.chdir(tmp_path)
    np.savez("one.npz", M=np.eye(1), C=np.eye(1), K=1e4 * np.eye(1))
    Path("one.toml").write_text(
        'schema = 2\n[structure]\nkind = "plain"\nfile = "one.npz"\n[[load]]\ndof = 0\n'
        '[[sensor]]\nname = "m"\ndof = 0\n'
        '[sweep]\nfrom = "0.015 Hz"\nto = "0.017 Hz"\nstep = "0.0005 Hz"\n[harmonics]\nhighest = 1\n'
    )
    assert cli.main(["solve", "one.toml", "--quiet", "--out", "solved"]) == 0
    said = capsys.readouterr().err
    assert "one.toml:10: sweep: " in said
    assert "15.92 Hz" in said
