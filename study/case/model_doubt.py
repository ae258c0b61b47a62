"""Warnings about implausible models: an unusual first natural frequency, a sweep far below it, or a doubtful mesh.

A mistake of a unit in a mesh, in matrices or in a sweep gives a valid model of the wrong structure.
"""

import warnings
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.plausibility import BODY_SIZE, FIRST_FREQUENCY
from fe.coincident_nodes import find_coincident_nodes
from fe.element import HEX8
from fe.mesh import Mesh
from geometry.errors import InputWarning
from reduction.jointed_system import JointedSystem
from reduction.stuck import stick_at_rest, stuck_stiffness
from study.case.sweep_table import FrequencySweepTable
from study.case.tables import Case

#: Largest ratio of a frequency of rigid motion to the frequency of the next mode [-].
RIGID = 1e-3
#: A sweep below this fraction of the first natural frequency shows a quasi-static response without resonance [-].
QUASI_STATIC = 0.01
#: Largest number of degrees of freedom for which all natural frequencies are computed: some seconds.
MOST_DOFS = 1500
#: Units of length in files, by their size [m].
UNITS = {1.0: "m", 1e-3: "mm", 1e-6: "um", 0.0254: "inch"}
#: Mistakes of units, and the ratio of the true to the computed frequencies [-].
SLIPS = (
    (1e9**0.5, "a density in kg/m^3 that was read as kg/mm^3"),
    (1e12**0.5, "a density in kg/m^3 in a model in mm, tonne, s"),
    (1e3**0.5, "stiffness in N/mm with mass in kg"),
    (1e-3**0.5, "mass in tonne with stiffness in N/m"),
    (1e-12**0.5, "a density in tonne/mm^3 in a model in m, kg, s"),
)


def compute_natural_frequencies(system: JointedSystem) -> Float[NDArray[np.float64], " mode"]:
    """Frequencies of elastic modes, for the contacts as at rest and for all contacts closed, ascending [Hz].

    Empty for more than `MOST_DOFS` degrees of freedom, and for a mass that is not positive definite.
    """
    if len(system.mass) > MOST_DOFS:
        return np.zeros(0)
    joined = (join(system.stiffness, system.joints) for join in (stick_at_rest, stuck_stiffness))
    try:
        return np.sort(np.concatenate([_compute_elastic(system.mass, stiffness) for stiffness in joined]))
    except scipy.linalg.LinAlgError:  # a mass that is not positive definite is refused by the computations that use it
        return np.zeros(0)


def _compute_elastic(
    mass: Float[NDArray[np.float64], "r r"], stiffness: Float[NDArray[np.float64], "r r"]
) -> Float[NDArray[np.float64], " mode"]:
    squared = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    frequency = np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi)
    # The last large jump among the six motions of a rigid body, if there is one, lies below the first elastic mode.
    rigid = np.flatnonzero(frequency[1:7] * RIGID > frequency[:-1][:6])
    return frequency[rigid[-1] + 1 if len(rigid) else 0 :]


def doubt_frequency(frequency: float) -> str:
    """Describe an implausible first natural frequency of a structure; empty if it is plausible.

    Parameters
    ----------
    frequency
        First natural frequency [Hz]; zero if it is unknown.
    """
    low, high = FIRST_FREQUENCY.usual
    if frequency <= 0 or low <= frequency <= high:
        return ""
    # The mistakes for which the true frequency would be between those of a tall building and of a small blade.
    meant = " or ".join(what for factor, what in SLIPS if 1.0 <= frequency * factor <= 1e4)
    return (
        f"mode 1 is at {frequency:.2g} Hz, but {FIRST_FREQUENCY.usual_of} have {low:g} to {high:.0e} Hz: "
        + (f"{meant}?" if meant else "check the units of mass and stiffness")
    )  # fmt: skip


def doubt_sweep(natural: Float[NDArray[np.float64], " mode"], first: float, last: float) -> str:
    """Describe a range of frequencies [Hz] far below the natural frequencies of a model; empty if it is not.

    `study.solve.frequency_range` checks for ranges above them.
    """
    low, high = sorted((first, last))
    if not len(natural) or high >= QUASI_STATIC * natural[0]:
        return ""
    return (
        f"{low:.4g} to {high:.4g} Hz lie far below the first natural frequency, {natural[0]:.4g} Hz: there is no "
        "resonance in this range; check the unit of the frequencies and those of the structure"
    )


def warn_of_model(case: Case[Any], system: JointedSystem, *, swept: bool) -> None:
    """Warn of an implausible model of a case, with file and line.

    Parameters
    ----------
    case
        Case of the model.
    system
        Structure with joints.
    swept
        Whether the response at the frequencies of ``[sweep]`` is computed.
    """
    natural = compute_natural_frequencies(system)
    table, doubt = "structure", doubt_frequency(float(natural[0]) if len(natural) else 0.0)
    if not doubt and swept and isinstance(case.sweep, FrequencySweepTable):
        table, doubt = "sweep", doubt_sweep(natural, case.sweep.first, case.sweep.last)
    if doubt:
        message = doubt if case.source is None else str(case.source.problem((table,), doubt))
        warnings.warn(message, InputWarning, stacklevel=2)


def warn_of_frequency(frequency: float) -> None:
    """Warn of an implausible first natural frequency [Hz]."""
    if doubt := doubt_frequency(frequency):
        warnings.warn(doubt, InputWarning, stacklevel=2)


def warn_of_size(longest: float, unit: float) -> None:
    """Warn of a body of implausible size for a vibration test.

    Parameters
    ----------
    longest
        Longest side of the body's bounding box [m].
    unit
        Unit of length of the file [m].
    """
    text = f"{longest / unit:g} {UNITS[unit]}" if unit in UNITS else ""
    if doubt := BODY_SIZE.doubt(longest, text):
        warnings.warn(f"the longest side of the body: {doubt}", InputWarning, stacklevel=2)


def warn_of_linear_cells(mesh: Mesh, file: str) -> None:
    """Warn of hexahedra of 8 nodes, which make a slender body tens of per cent too stiff."""
    if HEX8.cell_type in mesh.cells:
        warnings.warn(
            f"{file} has hexahedra of 8 nodes, which are too stiff in bending: use hexahedra of 20 nodes",
            InputWarning,
            stacklevel=2,
        )


def warn_of_seams(mesh: Mesh, file: str) -> None:
    """Warn of coincident nodes that are not merged: bodies, or volumes of a body, that are not connected."""
    if pairs := len(find_coincident_nodes(mesh)):
        warnings.warn(
            f"{file} has {pairs} pairs of coincident nodes that are not connected: merge them in your mesher, unless "
            'two bodies touch there (docs/own_part.md, "Two bodies that touch")',
            InputWarning,
            stacklevel=2,
        )
