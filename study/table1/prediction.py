"""A row that nothing was tuned to, for comparison with the closed form and with CalculiX."""

from dataclasses import dataclass, replace

import numpy as np

from fe.calculix_run import run_frequency
from fe.element import HEX20
from pipeline.store import stage
from study.kind.blade.model import BladeModel, first_frequency
from study.kind.blade.table import mesh_any
from study.table1.theory import locking_factor

#: The quadratic model that stands for the exact bending of a blade: model 5 of the table.
REFERENCE_THROUGH_THICKNESS = 4


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """First frequency of an untuned model, and what it is compared with.

    Parameters
    ----------
    frequency
        By our elements [Hz].
    factor
        Closed-form ratio of the frequency to the quadratic model's [-].
    calculix
        By CalculiX on the same mesh [Hz]; None if it is not installed.
    n_dof
        Free degrees of freedom [-].
    """

    frequency: float
    factor: float
    calculix: float | None
    n_dof: int


def quadratic(inputs: BladeModel) -> BladeModel:
    """The model that stands for the exact bending of the same blade."""
    return replace(inputs, element=HEX20.name, through_thickness=REFERENCE_THROUGH_THICKNESS, drop_every=0)


@stage("mesh-study reference")
def reference(inputs: BladeModel) -> float:
    """First frequency [Hz] of a quadratic model, to which the closed form is applied."""
    return first_frequency(inputs)[1]


@stage("mesh-study prediction")
def prediction(inputs: BladeModel, ask_calculix: bool) -> Prediction:
    """Compute a prediction of an 8-node model with a full clamp."""
    mesh, frequency, n_dof = first_frequency(inputs)
    return Prediction(
        frequency=frequency,
        factor=locking_factor(inputs.blade, inputs.material, mesh, inputs.through_thickness),
        calculix=calculix_frequency(inputs) if ask_calculix else None,
        n_dof=n_dof,
    )


@stage("mesh-study witness")
def witness(inputs: BladeModel) -> float:
    """First frequency of a fully clamped row by CalculiX [Hz]."""
    return calculix_frequency(inputs)


def calculix_frequency(inputs: BladeModel) -> float:
    """First frequency of a fully clamped model by CalculiX [Hz]."""
    mesh = mesh_any(inputs.blade, inputs.rule, inputs.pads)
    nodes = mesh.nodes("clamp")
    fixed = np.stack([np.repeat(nodes, 3), np.tile(np.arange(3), len(nodes))], axis=1)
    return float(run_frequency(mesh, inputs.material, fixed, 1)[0])
