"""``stickslip solve`` of a rig: rest under the dead weights, response curves, and what contacts and load cells do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reduction.rigid_body import RigidBody
from study.case.setup import ReadCase
from study.kind.rig.force_pictures import draw_film, draw_forces, most_loaded
from study.kind.rig.forces import RigForces, rig_forces
from study.kind.rig.system import RestingRig
from study.run_context import RunContext
from study.solve.result import main_harmonic
from study.solve.run import Solved


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
    """What the command reports of a rig.

    Parameters
    ----------
    labels
        Of the curves.
    rest
        By pair.
    dampers
        How the contacts hold them.
    peaks
        Forces at the highest point of each curve.
    files
        Written ones.
    """

    labels: Sequence[str]
    rest: Mapping[str, LineAtRest]
    dampers: Sequence[RigidBody]
    peaks: Sequence[RigForces]
    files: tuple[Path, ...]


def solved_rig(read: ReadCase, solved: Solved, run: RunContext) -> SolvedRig:
    """Contact forces and load cells at the highest points of solved curves; writes their figures and a film.

    Parameters
    ----------
    read
        The case of a rig.
    solved
        Its curves.
    run
        Where to.
    """
    resting: RestingRig = read.structure.details
    model, curves, stem, title = solved.model, solved.curves, read.opened.path.stem, read.opened.title
    harmonic, balance = main_harmonic(model.system), solved.balance
    states = [each.state(balance, each.peak(model.outputs[0], harmonic)) for each in curves]
    peaks = [rig_forces(resting, balance.at_level(state.level), state) for state in states]
    contacts = {each.name: each for each in resting.rest.contacts}
    friction = {line: contacts[names[0]].friction_coefficient for line, names in resting.joined.lines.items()}
    labels = [each.curve.label for each in curves]
    chosen = most_loaded([each.curve.fixed for each in curves], peaks)
    files = draw_forces(stem, title, friction, labels, peaks, chosen, run)
    # At the highest level the film shows most.
    last = chosen[-1]
    motion = resting.reduction.assembly.on_whole_mesh(states[last].coefficients.T)
    files += draw_film(
        stem, title, resting.model, labels[last], states[last].angular_frequency, motion, peaks[last], run
    )
    return SolvedRig(labels=labels, rest=_at_rest(resting), dampers=resting.dampers, peaks=peaks, files=tuple(files))


def _at_rest(system: RestingRig) -> dict[str, LineAtRest]:
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
