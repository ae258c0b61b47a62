"""Stages of a mesh study: rows of the table, untuned predictions, nested meshes, and checks with CalculiX."""

import resource
import sys
import time
from dataclasses import dataclass, replace
from math import log

import numpy as np

from fe.calculix_run import run_frequency
from fe.element import HEX20
from geometry.errors import InputError
from pipeline.store import stage
from study.kind.blade.model import BladeModel, compute_first_frequency, reduce_blade
from study.kind.blade.table import mesh_any
from study.reduce.comparison import ComparedFrequencies
from study.table1.theory import compute_locking_factor

#: Elements through the thickness of the quadratic reference model for exact bending of a blade: model 5 of the table.
REFERENCE_THROUGH_THICKNESS = 4
#: Orders below this fraction of the theoretical 2 p are limited by a corner or the clamp's edge, not the element [-].
FAR_FROM_THEORY = 0.75


@dataclass(frozen=True, kw_only=True, eq=False)
class RowResult(ComparedFrequencies):
    """Frequencies of one row by three methods (full, reduced, harmonic balance), with time and memory.

    Parameters
    ----------
    peak_natural
        Natural frequency from the harmonic-balance peak, as in `study.kind.blade.model.Reduction` [Hz].
    n_dof, n_fixed
        Numbers of free degrees of freedom and of fixed nodes [-].
    seconds, memory
        Wall-clock time and peak memory of the process [s, byte].
    """

    peak_natural: float
    n_dof: int
    n_fixed: int
    seconds: float
    memory: float


@stage("mesh-study row")
def row(inputs: BladeModel) -> RowResult:
    """Compute one row of the mesh study."""
    start = time.perf_counter()
    result = reduce_blade(inputs)
    return RowResult(
        frequency=result.frequency,
        rom_frequency=result.rom_frequency,
        rom_error=result.rom_error,
        peak_natural=result.peak_natural,
        n_dof=result.n_dof,
        n_fixed=result.n_fixed,
        seconds=time.perf_counter() - start,
        memory=measure_peak_memory(),
    )


def measure_peak_memory() -> float:
    """Peak memory of this process so far [byte]."""
    unit = 1 if sys.platform == "darwin" else 1024  # Linux reports kilobytes
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)


@dataclass(frozen=True, kw_only=True)
class UntunedPrediction:
    """First frequency of an untuned model, with a closed form and CalculiX for comparison.

    Parameters
    ----------
    frequency
        Frequency by the elements of the program [Hz].
    factor
        Closed-form ratio of the frequency to that of the quadratic model [-].
    calculix
        Frequency by CalculiX on the same mesh [Hz]; None if it is not installed.
    n_dof
        Number of free degrees of freedom [-].
    """

    frequency: float
    factor: float
    calculix: float | None
    n_dof: int


def quadratic(inputs: BladeModel) -> BladeModel:
    """Quadratic reference model of the same blade, for exact bending."""
    return replace(inputs, element=HEX20.name, through_thickness=REFERENCE_THROUGH_THICKNESS, drop_every=0)


@stage("mesh-study reference")
def reference(inputs: BladeModel) -> float:
    """First frequency [Hz] of a quadratic model, to which the closed form is applied."""
    return compute_first_frequency(inputs)[1]


@stage("mesh-study prediction")
def prediction(inputs: BladeModel, ask_calculix: bool) -> UntunedPrediction:
    """Compute the prediction of an 8-node model with a full clamp."""
    mesh, frequency, n_dof = compute_first_frequency(inputs)
    return UntunedPrediction(
        frequency=frequency,
        factor=compute_locking_factor(inputs.blade, inputs.material, mesh, inputs.through_thickness),
        calculix=compute_calculix_frequency(inputs) if ask_calculix else None,
        n_dof=n_dof,
    )


@stage("mesh-study witness")
def witness(inputs: BladeModel) -> float:
    """First frequency of a fully clamped row by CalculiX [Hz]."""
    return compute_calculix_frequency(inputs)


def compute_calculix_frequency(inputs: BladeModel) -> float:
    """First frequency of a fully clamped model by CalculiX [Hz]."""
    mesh = mesh_any(inputs.blade, inputs.rule, inputs.pads)
    nodes = mesh.nodes("clamp")
    fixed = np.stack([np.repeat(nodes, 3), np.tile(np.arange(3), len(nodes))], axis=1)
    return float(run_frequency(mesh, inputs.material, fixed, 1)[0])


@dataclass(frozen=True, kw_only=True)
class NestedPoint:
    """First frequency on one of the nested meshes [Hz], and its number of degrees of freedom [-]."""

    frequency: float
    n_dof: int


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Limit from Richardson's extrapolation of three nested meshes.

    Parameters
    ----------
    frequency
        Extrapolated frequency [Hz].
    order
        Observed exponent of the element size in the error [-].
    theory
        Exponent for a smooth solution, 2 p [-].
    """

    frequency: float
    order: float
    theory: int

    @property
    def warning(self) -> str:
        """Warning that the observed order is far below the theoretical one; empty if it is not."""
        if self.order >= FAR_FROM_THEORY * self.theory:
            return ""
        return (
            f"The observed order {self.order:.2f} is far below {self.theory}, that of a smooth solution: the stress "
            "is singular at the re-entrant corner of the root and at the clamp's edge, and uniform refinement hardly "
            "helps there. The limit is an estimate."
        )


@stage("mesh-study limit")
def nested_point(inputs: BladeModel) -> NestedPoint:
    """First frequency of one nested mesh."""
    _, frequency, n_dof = compute_first_frequency(inputs)
    return NestedPoint(frequency=frequency, n_dof=n_dof)


def richardson(frequencies: list[float], ratio: float, degree: int) -> Limit:
    """Extrapolate the limit and the observed order from three meshes, each `ratio` times finer than the one before.

    Parameters
    ----------
    frequencies
        Frequencies on the coarse, medium and fine mesh [Hz].
    ratio
        Ratio of element sizes [-], above 1.
    degree
        Polynomial degree p of the element [-].

    Raises
    ------
    InputError
        If the frequencies do not approach a limit: their differences change sign or do not decrease.

    References
    ----------
    Roache, Verification and Validation in Computational Science and Engineering (1998), ch. 5.
    """
    coarse, medium, fine = frequencies
    first, second = coarse - medium, medium - fine
    if not first * second > 0 or abs(first) <= abs(second):
        raise InputError(
            f"frequencies {coarse:.6g}, {medium:.6g}, {fine:.6g} Hz of the nested meshes do not converge: start from "
            "a finer mesh"
        )
    order = log(first / second) / log(ratio)
    return Limit(frequency=fine - second / (ratio**order - 1), order=order, theory=2 * degree)
