"""Engineering model of the beam of the virtual test bench: few elements, three contact stations per line.

The beam is a cantilever in plane bending (Hermite elements) between two inclined contact flanks. Drawing and numbers
are those of the specimen in `transient.virtual_bench.beam`, which has another discretisation.
"""

from math import pi, sqrt

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.model import Dof, LineSensor, Model, Sensor
from reduction.jointed_system import FrictionContact, JointedSystem

Row = Float[NDArray[np.float64], " r"]
Matrix = Float[NDArray[np.float64], "r r"]

LENGTH, WIDTH, THICKNESS = 0.30, 0.020, 0.010
YOUNGS_MODULUS, DENSITY, DAMPING_RATIO = 205e9, 7850.0, 4e-3
PLACES = {"tip": 0.30, "slot": 0.21, "excitation": 0.18, "mid": 0.10}
#: Start and end of both contact lines [m], inclination of their flanks [rad], and their signs.
LINE_ENDS, FLANK_ANGLE, SIDES = (0.20, 0.22), pi / 6, {"left": 1.0, "right": -1.0}
TANGENTIAL_STIFFNESS, NORMAL_STIFFNESS, FRICTION_COEFFICIENT, PRELOAD = 3e6, 4e6, 0.5, 24.0
#: Gap of the right line at its last station [m]; it grows linearly from zero at the first.
GAP = 1e-6


def beam_model(n_element: int = 12, n_station: int = 3, n_harmonic: int = 8) -> Model:
    """Model of the beam with its sensors.

    Parameters
    ----------
    n_element
        Number of elements of equal length [-].
    n_station
        Number of contacts per line, odd [-].
    n_harmonic
        Number of harmonics including the static one, H + 1 [-].
    """
    mass, stiffness = _assemble_matrices(n_element)
    r = len(mass)
    joints, lines, static = [], {}, np.zeros(r)
    for line in SIDES:
        members = _make_line(line, n_element, n_station)
        joints += members
        lines[line] = tuple(contact.name for contact in members)
        static += np.sum([contact.preload * contact.normal for contact in members], axis=0)
    stuck = stiffness + sum(
        contact.tangential_stiffness * contact.tangents.T @ contact.tangents
        + contact.normal_stiffness * np.outer(contact.normal, contact.normal)
        for contact in joints
    )
    first, second = np.sqrt(eigh(stuck, mass, eigvals_only=True)[:2])
    alpha = 2 * DAMPING_RATIO * first * second / (first + second)
    beta = 2 * DAMPING_RATIO / (first + second)
    places = {name: _make_rows(x, n_element)[0] for name, x in PLACES.items()}
    force = np.zeros((2, r), dtype=np.complex128)
    force[1] = places["excitation"]
    system = JointedSystem(
        mass=mass,
        damping=alpha * mass + beta * stiffness,
        stiffness=stiffness,
        joints=joints,
        static_load=static,
        harmonic_force=force,
    )
    motions = [Sensor(name=name, row=row) for name, row in places.items()]
    forces = [
        LineSensor(name=f"{line}_{letter}", line=line, component=component)
        for line in SIDES
        for letter, component in (("T", "tangential"), ("N", "normal"))
    ]
    x = np.linspace(0, LENGTH, n_element + 1)[1:]
    dofs = [
        Dof(body="beam", node=node + 1, direction=direction, coordinates=np.array([at, 0.0, 0.0]))
        for node, at in enumerate(x)
        for direction in ("z", "ry")
    ]
    return Model(
        system=system,
        sensors=(*motions, *forces),
        dofs=tuple(dofs),
        lines=lines,
        places=places,
        linked_preloads=(tuple(lines),),
        n_harmonic=n_harmonic,
    )


def _assemble_matrices(n: int) -> tuple[Matrix, Matrix]:
    """Mass and stiffness of n Hermite elements, clamped at the first node; degrees of freedom w and w' by node."""
    a = LENGTH / n
    area, inertia = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    k = np.array([[12, 6 * a, -12, 6 * a], [0, 4 * a**2, -6 * a, 2 * a**2], [0, 0, 12, -6 * a], [0, 0, 0, 4 * a**2]])
    m = np.array(
        [[156, 22 * a, 54, -13 * a], [0, 4 * a**2, 13 * a, -3 * a**2], [0, 0, 156, -22 * a], [0, 0, 0, 4 * a**2]]
    )
    mass, stiffness = np.zeros((2, 2 * n + 2, 2 * n + 2))
    for element in range(n):
        at = slice(2 * element, 2 * element + 4)
        stiffness[at, at] += YOUNGS_MODULUS * inertia / a**3 * (k + np.triu(k, 1).T)
        mass[at, at] += DENSITY * area * a / 420 * (m + np.triu(m, 1).T)
    return mass[2:, 2:], stiffness[2:, 2:]


def _make_rows(x: float, n: int) -> tuple[Row, Row]:
    """Rows of w and w' at x."""
    a = LENGTH / n
    element = min(int(x / a + 1e-9), n - 1)
    s = x / a - element
    w, slope = np.zeros((2, 2 * n + 2))
    at = slice(2 * element, 2 * element + 4)
    w[at] = [1 - 3 * s**2 + 2 * s**3, a * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, a * (s**3 - s**2)]
    slope[at] = [(6 * s**2 - 6 * s) / a, 1 - 4 * s + 3 * s**2, (6 * s - 6 * s**2) / a, 3 * s**2 - 2 * s]
    return w[2:], slope[2:]


def _make_line(line: str, n_element: int, n_station: int) -> list[FrictionContact]:
    """Contacts of one line; weights by Simpson's rule preserve the second moment of its stiffness distribution."""
    weights = np.array([1.0, 4.0, *([2.0, 4.0] * (n_station // 2 - 1)), 1.0])
    side, sine, cosine = SIDES[line], 0.5, sqrt(3) / 2
    height = side * THICKNESS / 2
    contacts = []
    for number, (x, share) in enumerate(zip(np.linspace(*LINE_ENDS, n_station), weights / weights.sum(), strict=True)):
        w, slope = _make_rows(float(x), n_element)
        axial = -height * slope
        contacts.append(
            FrictionContact(
                name=f"{line}.{number + 1}",
                tangents=cosine * w + side * sine * axial,
                normal=side * sine * w - cosine * axial,
                tangential_stiffness=TANGENTIAL_STIFFNESS * share,
                normal_stiffness=NORMAL_STIFFNESS * share,
                friction_coefficient=FRICTION_COEFFICIENT,
                preload=PRELOAD * share,
                gap=GAP * number / (n_station - 1) if line == "right" else 0.0,
            )
        )
    return contacts
