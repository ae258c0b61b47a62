"""``stickslip solve`` of a rig: rest under the dead weights, response curves, and what contacts and load cells do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from casefile.table import load_case, located
from hbsolve.balance import HarmonicBalance
from reduction.rigid_body import RigidBody
from study.kind.rig.contact import dead_weights, line_pairs
from study.kind.rig.force_pictures import draw_film, draw_forces, most_loaded
from study.kind.rig.forces import RigForces, rig_forces
from study.kind.rig.reduction import reduce_rig
from study.kind.rig.system import RigSystem, rig_system
from study.kind.rig.table import RigCase, rig_model
from study.kind.rig.tetrahedra import in_tetrahedra
from study.reduce.mode_count import fewer_modes_of_rig
from study.run_context import RunContext
from study.solve.result import main_harmonic
from study.solve.run import Solved, solved_curves


@dataclass(frozen=True, kw_only=True, eq=False)
class LineAtRest:
    """One contact line under the dead weights.

    Parameters
    ----------
    normal, tangential
        Sums over its stations [N].
    n_closed
        Stations that are pressed [-].
    ratio
        Largest |T| / (mu N) of them [-].
    """

    normal: float
    tangential: float
    n_closed: int
    ratio: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedRig:
    """What the command reports.

    Parameters
    ----------
    solved
        The curves.
    rest
        By pair.
    dampers
        How the contacts hold them.
    peaks
        Forces at the highest point of each curve.
    """

    solved: Solved
    rest: Mapping[str, LineAtRest]
    dampers: Sequence[RigidBody]
    peaks: Sequence[RigForces]


def run_solve_rig(path: Path, run: RunContext) -> SolvedRig:
    """Reduce the rig of a case file unless that was done before, and compute its curves.

    Raises
    ------
    CaseError
        With every mistake of the case.
    ComputationFailed
        No steady state was found to start a curve from.
    """
    case = load_case(path, RigCase)
    model = rig_model(case)
    weights = dead_weights(case)
    with located(case, "mesh"):
        model = in_tetrahedra(model, run.store, run.progress)
        reduction = reduce_rig(model, run.store, run.progress)
    for sentence in fewer_modes_of_rig(reduction.assembly, model.n_mode):
        run.note(sentence)
    system = rig_system(case, model.rig, reduction)
    asked = system.model
    balance = HarmonicBalance(system=asked.system, n_harmonic=asked.harmonics + 1, n_sample=asked.n_sample)
    solved, curves = solved_curves(asked, balance, path.stem, case.title, run)
    harmonic = main_harmonic(asked.system)
    states = [each.state(balance, each.peak(asked.outputs[0], harmonic)) for each in curves]
    peaks = [
        rig_forces(model.rig, reduction, system, weights, balance.at_level(state.level), state) for state in states
    ]
    friction = {pair.name: pair.friction_coefficient for pair in line_pairs(case, model.rig)}
    labels = [each.curve.label for each in curves]
    chosen = most_loaded([each.curve.fixed for each in curves], peaks)
    files = [*solved.files, *draw_forces(path.stem, case.title, friction, labels, peaks, chosen, run)]
    # At the highest level the film shows most.
    last = chosen[-1]
    motion = reduction.assembly.on_whole_mesh(states[last].coefficients.T)
    files += draw_film(
        path.stem, case.title, model, labels[last], states[last].angular_frequency, motion, peaks[last], run
    )
    return SolvedRig(
        solved=replace(solved, files=tuple(files)), rest=_at_rest(system), dampers=system.dampers, peaks=peaks
    )


def _at_rest(system: RigSystem) -> dict[str, LineAtRest]:
    names = [contact.name for contact in system.joined.contacts]
    rest, found = system.rest, {}
    for line, members in system.joined.lines.items():
        rows = [names.index(name) for name in members]
        found[line] = LineAtRest(
            normal=float(rest.normal[rows].sum()),
            tangential=float(np.sum([rest.tangential[row][0] for row in rows])),
            n_closed=int(np.count_nonzero(rest.normal[rows])),
            ratio=float(rest.ratio[rows].max()),
        )
    return found
