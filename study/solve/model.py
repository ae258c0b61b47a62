"""From a case of ``stickslip solve`` to a jointed system; what is wrong with it is said at once, with file and line."""

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from casefile.errors import CaseError
from casefile.mistakes import Mistakes
from geometry.errors import InputError
from reduction.errors import JointError, MatrixError
from reduction.file.structure_file import StructureMatrices, load_matrices
from reduction.jointed_system import Joint, JointedSystem
from study.case.damping import case_damping
from study.case.joint import contact_joints
from study.case.joint_table import FrequencySweepTable, SolveCase
from study.case.old_place import Row, mean_row

#: Derivatives in time of each quantity that an output may show.
DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True, kw_only=True, eq=False)
class Output:
    """What the results show by name.

    Parameters
    ----------
    name
        As in the case.
    row
        Over the structure's degrees of freedom, shape (r,) [-].
    quantity
        displacement, velocity or acceleration [m, m/s, m/s^2].
    """

    name: str
    row: Row
    quantity: str

    @property
    def derivative(self) -> int:
        """How often the displacement is derived in time [-]."""
        return DERIVATIVE[self.quantity]


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """One curve that a case asks for.

    Parameters
    ----------
    parameter
        What varies along it, "frequency" or "level".
    first, last
        Its ends [rad/s, or - for levels].
    fixed
        The other one of the two.
    step
        The largest along it, in the unit of its ends; None leaves it to the solver.
    label
        For people: "level 3", "40 Hz".
    slider
        Where the sliders begin, shape (s,) [m]; springs without tension by default.
    """

    parameter: str
    first: float
    last: float
    fixed: float
    step: float | None
    label: str
    slider: Row | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class SolveModel:
    """All that a case asks for.

    Parameters
    ----------
    system
        Structure, joints and loads at level 1.
    outputs
        In the order of the case.
    curves
        In the order of the case.
    harmonics, n_sample
        H, and samples a period [-].
    """

    system: JointedSystem
    outputs: tuple[Output, ...]
    curves: tuple[Curve, ...]
    harmonics: int
    n_sample: int


def solve_model(case: SolveCase, folder: Path) -> SolveModel:
    """Read the structure and put joints, loads and outputs on it.

    Parameters
    ----------
    case
        As `casefile.table.load_case` returned it.
    folder
        That of the case file, which the structure's file is relative to.

    Raises
    ------
    CaseError
        With every mistake that can be seen without computing a curve.
    """
    mistakes = Mistakes(case)
    structure = None
    with mistakes.at("model"):
        structure = _structure(folder / case.model.file)
    _check_harmonics(case, mistakes)
    if structure is None:
        raise CaseError(mistakes.problems)
    joints: list[Joint] = []
    for number in range(len(case.contact)):
        with mistakes.at("contact", number):
            joints += contact_joints(case, case.contact, number, structure)
    _check_names(case, mistakes)
    static, harmonic = _loads(case, structure, mistakes)
    outputs = []
    for number, each in enumerate(case.output):
        with mistakes.at("output", number):
            outputs.append(Output(name=each.name, row=mean_row(each, structure), quantity=each.quantity))
    mistakes.raise_if_any()
    damping = structure.damping
    if case.damping is not None:
        with mistakes.at("damping"):
            damping = case_damping(case.damping, structure, joints)
    mistakes.raise_if_any()
    system = JointedSystem(
        mass=structure.mass,
        damping=damping,
        stiffness=structure.stiffness,
        joints=joints,
        static_load=static,
        harmonic_force=harmonic,
    )
    return SolveModel(
        system=system,
        outputs=tuple(outputs),
        curves=_curves(case),
        harmonics=case.sweep.harmonics,
        n_sample=case.sweep.n_sample,
    )


def _structure(file: Path) -> StructureMatrices:
    try:
        return load_matrices(file)
    except InputError as error:
        # Names the key, so that the line shown is that of the file's name.
        raise MatrixError(f"the file cannot be used: {error}") from error


def _check_harmonics(case: SolveCase, mistakes: Mistakes) -> None:
    kept = case.sweep.harmonics
    number, load = max(enumerate(case.load), key=lambda pair: pair[1].harmonic)
    if load.harmonic > kept:
        loses = "keeps the mean alone and loses" if kept == 0 else "loses"
        with mistakes.at("sweep"):
            raise JointError(
                f"harmonics = {kept} {loses} load[{number}], which acts at harmonic {load.harmonic}: take at least "
                f"{load.harmonic}; 5 or more show what friction does"
            )


def _check_names(case: SolveCase, mistakes: Mistakes) -> None:
    for kind, tables in (("contact", case.contact), ("output", case.output)):
        names = [table.name for table in tables]
        for number, name in enumerate(names):
            if name in names[:number]:
                with mistakes.at(kind, number):
                    raise JointError(f'name = "{name}" is taken by {kind}[{names.index(name)}]: give each its own')


def _loads(case: SolveCase, structure: StructureMatrices, mistakes: Mistakes) -> tuple[Row, NDArray[np.complex128]]:
    static = np.zeros(structure.n_dof)
    harmonic = np.zeros((max(load.harmonic for load in case.load) + 1, structure.n_dof), dtype=np.complex128)
    for number, constant in enumerate(case.static_load):
        with mistakes.at("static_load", number):
            static += constant.force * mean_row(constant, structure)
    for number, load in enumerate(case.load):
        with mistakes.at("load", number):
            harmonic[load.harmonic] += load.amplitude * np.exp(1j * load.phase) * mean_row(load, structure)
    if not mistakes.problems and not harmonic.any():
        with mistakes.at("load", 0):
            raise JointError("amplitude: all harmonic loads cancel or are zero, so that nothing vibrates: give one")
    return static, harmonic


def _curves(case: SolveCase) -> tuple[Curve, ...]:
    sweep = case.sweep
    if isinstance(sweep, FrequencySweepTable):
        first, last = 2 * pi * sweep.first, 2 * pi * sweep.last
        step = None if sweep.step is None else 2 * pi * sweep.step
        return tuple(
            Curve(parameter="frequency", first=first, last=last, fixed=level, step=step, label=f"level {level:g}")
            for level in sweep.levels
        )
    return tuple(
        Curve(
            parameter="level",
            first=sweep.first,
            last=sweep.last,
            fixed=2 * pi * each,
            step=sweep.step,
            label=f"{each:g} Hz",
        )
        for each in sweep.frequencies
    )
