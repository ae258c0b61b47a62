r"""The virtual test bench's own model of its beam: a clamped beam between two contact lines on inclined flanks.

Euler-Bernoulli elements with cubic shape functions, more of them than a model that is to be tested on its data, and
contact stations at other places than drawn; static shapes of all points where forces act and the lowest vibration
shapes then reduce it to some 25 degrees of freedom, in which integration is cheap:

.. math:: w(x, t) \approx \sum_j \psi_j(x) a_j(t), \qquad t = \cos\beta\, w \mp \sin\beta\, z_c\, w', \qquad
          n = \pm(\sin\beta\, w \pm \cos\beta\, z_c\, w')

with the tangential and normal displacements t and n (closing) of the flanks at the heights z_c, upper signs left.

References
----------
Przemieniecki, Theory of Matrix Structural Analysis (1968), sections 5.6 and 11.5, for the element.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from reduction.array_type import Matrix, Vector
from reduction.jointed_system import FrictionContact, JointedSystem

LENGTH = 0.30
WIDTH = 0.020
THICKNESS = 0.010
DENSITY = 7850.0
YOUNGS_MODULUS = 205e9
FLANK_ANGLE = np.pi / 6
#: Heights of the flanks above the neutral axis [m].
FLANK_HEIGHT = {"left": THICKNESS / 2, "right": -THICKNESS / 2}
#: Where both lines begin and end [m].
LINE_ENDS = (0.20, 0.22)
#: Points that move under a sensor, a force or an effect [m].
PLACES = {"tip": 0.30, "slot": 0.21, "excitation": 0.18, "mid": 0.10}

N_ELEMENT = 60
#: Contact stations of both lines as drawn [m], and the least share of their distance that those of a specimen have.
STATIONS = (0.200, 0.210, 0.220)
CLOSEST = 0.93
#: Vibration shapes beside the static ones.
N_MODE = 6


@dataclass(frozen=True, kw_only=True)
class BeamParameters:
    """Parameters of the beam and its contacts."""

    youngs_modulus: float = YOUNGS_MODULUS
    """[Pa]."""
    damping_ratio: float = 0.004
    """Of the first two modes with sticking contacts at the drawing's stiffnesses [-]."""
    tangential_stiffness: float = 3.0e6
    normal_stiffness: float = 4.0e6
    """Of a whole line [N/m]."""
    friction_coefficient: tuple[float, float] = (0.5, 0.5)
    preload: tuple[float, float] = (24.0, 24.0)
    gap: tuple[float, float] = (0.0, 1e-6)
    """By line; preload of a whole line [N], gap at its end, linear from 0 at its beginning [-, N, m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Beam:
    """Matrices of the beam without contacts and the rows of its points."""

    mass: Matrix
    stiffness: Matrix
    """Shape (r, r) [kg, N/m], stiffness at the drawing's modulus."""
    places: Mapping[str, Vector]
    """Rows of the deflection w at `PLACES`, each of shape (r,) [-]."""
    station: Vector
    """Where the stations are, shape (s,) [m]."""
    deflection: Matrix
    slope: Matrix
    """Rows of w and w' at the stations, shape (s, r) [-, 1/m]."""


@lru_cache(maxsize=4)
def full_beam(stations: tuple[float, ...] = STATIONS) -> Beam:
    """All degrees of freedom w, w' of the nodes behind the clamp."""
    s = LENGTH / N_ELEMENT
    inertia, area = WIDTH * THICKNESS**3 / 12, WIDTH * THICKNESS
    element_stiffness = (YOUNGS_MODULUS * inertia / s**3) * np.array(
        [
            [12, 6 * s, -12, 6 * s],
            [6 * s, 4 * s**2, -6 * s, 2 * s**2],
            [-12, -6 * s, 12, -6 * s],
            [6 * s, 2 * s**2, -6 * s, 4 * s**2],
        ]
    )
    element_mass = (DENSITY * area * s / 420) * np.array(
        [
            [156, 22 * s, 54, -13 * s],
            [22 * s, 4 * s**2, 13 * s, -3 * s**2],
            [54, 13 * s, 156, -22 * s],
            [-13 * s, -3 * s**2, -22 * s, 4 * s**2],
        ]
    )
    n = 2 * (N_ELEMENT + 1)
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    for element in range(N_ELEMENT):
        at = slice(2 * element, 2 * element + 4)
        mass[at, at] += element_mass
        stiffness[at, at] += element_stiffness
    rows = [_make_hermite_rows(x) for x in stations]
    return Beam(
        mass=mass[2:, 2:],
        stiffness=stiffness[2:, 2:],
        places={name: _make_hermite_rows(x)[0, 2:] for name, x in PLACES.items()},
        station=np.array(stations),
        deflection=np.array([item[0, 2:] for item in rows]),
        slope=np.array([item[1, 2:] for item in rows]),
    )


@lru_cache(maxsize=4)
def reduced_beam(stations: tuple[float, ...] = STATIONS) -> Beam:
    """The beam in static shapes of unit forces and moments at all its points, and `N_MODE` vibration shapes."""
    from scipy.linalg import eigh

    full = full_beam(stations)
    points = np.vstack([full.deflection, full.slope, *full.places.values()])
    static = np.linalg.solve(full.stiffness, points.T)
    modes = eigh(full.stiffness, full.mass, subset_by_index=(0, N_MODE - 1))[1]
    # Modes of the subspace: mass-normalised, and directions that other shapes contain already drop out.
    shapes = np.column_stack([static / np.linalg.norm(static, axis=0), modes / np.linalg.norm(modes, axis=0)])
    factor = np.linalg.cholesky(full.stiffness).T
    left, singular, _ = np.linalg.svd(factor @ shapes, full_matrices=False)
    basis = np.linalg.solve(factor, left[:, singular > 1e-9 * singular[0]])
    basis = basis @ eigh(basis.T @ full.stiffness @ basis, basis.T @ full.mass @ basis)[1]
    return Beam(
        mass=_symmetrise(basis.T @ full.mass @ basis),
        stiffness=_symmetrise(basis.T @ full.stiffness @ basis),
        places={name: row @ basis for name, row in full.places.items()},
        station=full.station,
        deflection=full.deflection @ basis,
        slope=full.slope @ basis,
    )


def contacts(beam: Beam, parameters: BeamParameters) -> tuple[FrictionContact, ...]:
    """Stations of the left line, then of the right one; a station has its share of the line's numbers."""
    shares = compute_station_shares(beam.station)
    first, last = LINE_ENDS
    along = (beam.station - first) / (last - first)
    sine, cosine = np.sin(FLANK_ANGLE), np.cos(FLANK_ANGLE)
    joints = []
    for number, (line, height) in enumerate(FLANK_HEIGHT.items()):
        sign = 1.0 if line == "left" else -1.0
        axial = -height * beam.slope
        for station, share in enumerate(shares):
            w, a = beam.deflection[station], axial[station]
            joints.append(
                FrictionContact(
                    name=f"{line} {station + 1}",
                    normal=sign * sine * w - cosine * a,
                    tangents=cosine * w + sign * sine * a,
                    normal_stiffness=share * parameters.normal_stiffness,
                    tangential_stiffness=share * parameters.tangential_stiffness,
                    friction_coefficient=parameters.friction_coefficient[number],
                    preload=share * parameters.preload[number],
                    gap=parameters.gap[number] * along[station],
                )
            )
    return tuple(joints)


def compute_station_shares(station: Vector) -> Vector:
    """Share of each station in a line, which gives a uniform line its moments (Simpson's rule where drawn), shape (n,).

    With the trapezoid rule models of 3 and 5 stations differ by 0.5 % in their stuck frequencies, with this by 1e-5.
    """
    first, last = LINE_ENDS
    x = (2 * station - first - last) / (last - first)
    powers = np.arange(len(x))
    return np.asarray(np.linalg.solve(x ** powers[:, None], np.where(powers % 2 == 0, 1 / (powers + 1), 0.0)))


def stations_at(share: float) -> tuple[float, ...]:
    """Stations at a share of their drawn distance from the middle of the line [m]."""
    middle = sum(LINE_ENDS) / 2
    return tuple(float(x) for x in middle + share * (np.array(STATIONS) - middle))


def random_stations(random: np.random.Generator) -> tuple[float, ...]:
    """Stations of a specimen, whose contacts are nearer to the middle of their lines than in the drawing."""
    return stations_at(random.uniform(CLOSEST, 1.0))


@lru_cache(maxsize=16)
def _compute_rayleigh(beam: Beam) -> tuple[float, float]:
    """Alpha and beta of alpha M + beta K for a damping ratio of 1 in the first two modes with sticking contacts."""
    first = compute_stuck_angular_frequencies(beam, BeamParameters())
    w1, w2 = float(first[0]), float(first[1])
    return 2 * w1 * w2 / (w1 + w2), 2 / (w1 + w2)


def compute_stuck_angular_frequencies(beam: Beam, parameters: BeamParameters) -> Vector:
    """With all contacts closed and sticking, ascending, shape (r,) [rad/s]."""
    from scipy.linalg import eigvalsh

    stiffness = beam.stiffness * (parameters.youngs_modulus / YOUNGS_MODULUS)
    for joint in contacts(beam, parameters):
        stiffness = stiffness + joint.normal_stiffness * np.outer(joint.normal, joint.normal)
        stiffness = stiffness + joint.tangential_stiffness * joint.tangents.T @ joint.tangents
    return np.asarray(np.sqrt(eigvalsh(stiffness, beam.mass)), dtype=np.float64)


def jointed_beam(beam: Beam, parameters: BeamParameters) -> JointedSystem:
    """The beam between its contact lines, preloads in balance at rest, 1 N at the excitation point."""
    joints = contacts(beam, parameters)
    static = np.sum([joint.preload * joint.normal for joint in joints], axis=0)
    return _make_system(beam, parameters, joints, static)


def free_beam(beam: Beam, parameters: BeamParameters) -> JointedSystem:
    """The beam without its contact lines."""
    return _make_system(beam, parameters, (), np.zeros(len(beam.mass)))


def _make_system(
    beam: Beam, parameters: BeamParameters, joints: tuple[FrictionContact, ...], static: Vector
) -> JointedSystem:
    alpha, beta = _compute_rayleigh(beam)
    # Damping belongs to the structure as drawn: a deviation of its modulus does not change it.
    damping = parameters.damping_ratio * (alpha * beam.mass + beta * beam.stiffness)
    return JointedSystem(
        mass=beam.mass,
        damping=damping,
        stiffness=beam.stiffness * (parameters.youngs_modulus / YOUNGS_MODULUS),
        joints=joints,
        static_load=static,
        harmonic_force=np.array([np.zeros(len(beam.mass)), beam.places["excitation"]]),
    )


def _make_hermite_rows(x: float) -> Matrix:
    """Rows of w and w' at x over all nodes, shape (2, 2 (N_ELEMENT + 1))."""
    s = LENGTH / N_ELEMENT
    element = min(int(x / s + 1e-9), N_ELEMENT - 1)
    e = x / s - element
    rows = np.zeros((2, 2 * (N_ELEMENT + 1)))
    rows[0, 2 * element : 2 * element + 4] = [
        1 - 3 * e**2 + 2 * e**3,
        s * (e - 2 * e**2 + e**3),
        3 * e**2 - 2 * e**3,
        s * (e**3 - e**2),
    ]
    rows[1, 2 * element : 2 * element + 4] = [
        (6 * e**2 - 6 * e) / s,
        1 - 4 * e + 3 * e**2,
        (6 * e - 6 * e**2) / s,
        3 * e**2 - 2 * e,
    ]
    return rows


def _symmetrise(matrix: Matrix) -> Matrix:
    return np.asarray((matrix + matrix.T) / 2)
