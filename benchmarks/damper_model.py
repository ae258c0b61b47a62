"""A blade with a platform, two dampers and 28 contacts: the problem size for which the solver was designed.

All parts are beams: a clamped steel blade that bends in x; a platform across its middle, a damper below each side of
the platform, and a de-coupler beside each damper. The last five are beams along z with seven nodes each, at which the
contacts are; the centrifugal load presses the dampers in y into the wedges between platform and de-couplers. A rotation
of the blade raises one side of the platform and lowers the other, so that the normal loads change with the vibration.
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from reduction.jointed_system import FrictionContact, JointedSystem
from reduction.stuck import stuck_stiffness

YOUNG, DENSITY = 2.1e11, 7800.0
BLADE_LENGTH, BLADE_SECTION, BLADE_ELEMENTS = 0.35, (0.018, 0.04), 20
N_NODE = 7
Z = np.linspace(-0.018, 0.018, N_NODE)
#: Height of the section in x and in y [m].
SECTIONS = {
    "platform": (0.02, 0.016),
    "left": (0.014, 0.012),
    "right": (0.014, 0.012),
    "left de-coupler": (0.024, 0.024),
    "right de-coupler": (0.024, 0.024),
}
#: Distance of the platform's contacts from the axis of the blade [m], and angle of the wedge to the horizontal [rad].
CONTACT_OFFSET, WEDGE_ANGLE = 0.022, np.deg2rad(8.53)
CENTRIFUGAL_LOAD = 55.0
TANGENTIAL_STIFFNESS, NORMAL_STIFFNESS, FRICTION_COEFFICIENT = 4.6e6 / N_NODE, 8.5e6 / N_NODE, 0.8
#: Stiffness of each load cell below a de-coupler, and of the wire at each node of a damper [N/m]. The wires prevent a
#: damper in full slip from drifting.
LOAD_CELL, WIRE = 4e7, 2000.0 / N_NODE
CROWNING, ROUGHNESS = 1.5e-6, 0.4e-6
DAMPING_RATIO = 0.002

Matrix = NDArray[np.float64]


def beam(length: float, elements: int, height: float, width: float) -> tuple[Matrix, Matrix]:
    """Mass and stiffness of an Euler-Bernoulli beam that bends along its height; each node has deflection and slope."""
    h = length / elements
    rigidity, line_mass = YOUNG * width * height**3 / 12, DENSITY * width * height
    c, s = 6 * h, h * h
    k = [[12, c, -12, c], [c, 4 * s, -c, 2 * s], [-12, -c, 12, -c], [c, 2 * s, -c, 4 * s]]
    a, b = 22 * h, 13 * h
    m = [[156, a, 54, -b], [a, 4 * s, b, -3 * s], [54, b, 156, -a], [-b, -3 * s, -a, 4 * s]]
    mass, stiffness = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for i in range(elements):
        mass[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += line_mass * h / 420 * np.array(m)
        stiffness[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += rigidity / h**3 * np.array(k)
    return mass, stiffness


def damper_system(force: float) -> JointedSystem:
    """Blade with 28 contacts under a force [N] at 30 % of its length; its tip is degree of freedom `TIP`."""
    blocks = [beam(BLADE_LENGTH, BLADE_ELEMENTS, *BLADE_SECTION)]
    for x, y in SECTIONS.values():
        blocks += [beam(Z[-1] - Z[0], N_NODE - 1, x, y), beam(Z[-1] - Z[0], N_NODE - 1, y, x)]
    mass, stiffness = (scipy.linalg.block_diag(*matrices) for matrices in zip(*blocks, strict=True))
    n = len(mass)
    in_x, in_y, first = {}, {}, 2 * BLADE_ELEMENTS + 2
    for name in SECTIONS:
        in_x[name], in_y[name] = (first + 2 * N_NODE * i + 2 * np.arange(N_NODE) for i in (0, 1))
        first += 4 * N_NODE
    rows = np.eye(n)
    middle = BLADE_ELEMENTS
    for side in ("left", "right"):
        for dof in (*in_x[side], *in_y[side]):
            stiffness[dof, dof] += WIRE
        for node in (1, 3, 5):
            for dof in (in_x[f"{side} de-coupler"][node], in_y[f"{side} de-coupler"][node]):
                stiffness[dof, dof] += LOAD_CELL
    # The middle of the platform follows the blade in x; its slopes and its deflection in y are zero.
    shared = in_x["platform"][N_NODE // 2]
    rows[shared] = 0.0
    rows[shared, middle] = 1.0
    held = [0, 1, shared, shared + 1, in_y["platform"][N_NODE // 2], in_y["platform"][N_NODE // 2] + 1]
    keep = np.setdiff1d(np.arange(n), held)
    basis = rows[:, keep]
    static = np.zeros(n)
    contacts = []
    rough = np.random.default_rng(1)
    for side, outward in (("left", -1.0), ("right", 1.0)):
        static[in_y[side]] = CENTRIFUGAL_LOAD / N_NODE
        for partner, slope in (("platform", -outward), (f"{side} de-coupler", outward)):
            for node in range(N_NODE):
                x = rows[in_x[side][node]] - rows[in_x[partner][node]]
                y = rows[in_y[side][node]] - rows[in_y[partner][node]]
                if partner == "platform":
                    y = y + outward * CONTACT_OFFSET * rows[middle + 1]
                contacts.append(
                    FrictionContact(
                        name=f"{side} on {partner} {node}",
                        normal=(slope * np.sin(WEDGE_ANGLE) * x + np.cos(WEDGE_ANGLE) * y) @ basis,
                        tangents=(np.cos(WEDGE_ANGLE) * x - slope * np.sin(WEDGE_ANGLE) * y) @ basis,
                        normal_stiffness=NORMAL_STIFFNESS,
                        tangential_stiffness=TANGENTIAL_STIFFNESS,
                        friction_coefficient=FRICTION_COEFFICIENT,
                        gap=CROWNING * (Z[node] / Z[-1]) ** 2 + ROUGHNESS * rough.uniform(),
                    )
                )
    mass, stiffness = basis.T @ mass @ basis, basis.T @ stiffness @ basis
    load = np.zeros((2, n))
    load[1, 2 * round(0.3 * BLADE_ELEMENTS)] = force
    first_mode, third_mode = stuck_frequencies(mass, stiffness, contacts)[[0, 2]]
    stuck = stuck_stiffness(stiffness, contacts)
    damping = 2 * DAMPING_RATIO / (first_mode + third_mode) * (first_mode * third_mode * mass + stuck)
    return JointedSystem(
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        joints=contacts,
        static_load=static @ basis,
        harmonic_force=load @ basis,
    )


#: Index of the deflection of the tip among the free degrees of freedom.
TIP = 2 * BLADE_ELEMENTS - 2


def stuck_frequencies(mass: Matrix, stiffness: Matrix, contacts: list[FrictionContact]) -> Matrix:
    """Angular frequencies with all contacts stuck and closed [rad/s]."""
    squared = scipy.linalg.eigh(stuck_stiffness(stiffness, contacts), mass, eigvals_only=True)
    return np.asarray(np.sqrt(squared))
