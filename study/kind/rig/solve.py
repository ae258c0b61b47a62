"""``stickslip solve`` of a rig: rest under the dead weights, forces of contacts and load cells, pictures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from geometry.plain_number import format_number
from reduction.rigid_body import MOTIONS
from study.case.setup import ReadCase
from study.kind.registry import Extras
from study.kind.rig.force_pictures import choose_most_loaded, draw_film, draw_forces
from study.kind.rig.forces import compute_rig_forces
from study.kind.rig.structure import PreloadedRig
from study.run_context import RunContext
from study.solve.result import find_main_harmonic
from study.solve.run import SolveResult


def report_rig_extras(read: ReadCase, solved: SolveResult, run: RunContext) -> Extras:
    """Report the forces of contacts and load cells at the highest points of curves; write figures and a film.

    Parameters
    ----------
    read
        Case of a rig.
    solved
        Solved curves of the case.
    run
        Output folder, store and progress of the run.
    """
    preloaded: PreloadedRig = read.structure.details
    model, curves, stem, title = solved.model, solved.curves, read.opened.path.stem, read.opened.title
    harmonic, balance = find_main_harmonic(model.system), solved.balance
    highest = [item.peak(model.outputs[0], harmonic) for item in curves]
    states = [item.branch.state(balance, point) for item, point in zip(curves, highest, strict=True)]
    peaks = [
        compute_rig_forces(preloaded, item.branch.balance_at(balance, point), state)
        for item, point, state in zip(curves, highest, states, strict=True)
    ]
    contacts = {item.name: item for item in preloaded.static_state.contacts}
    friction = {line: contacts[names[0]].friction_coefficient for line, names in preloaded.joined.lines.items()}
    labels = [item.curve.label for item in curves]
    chosen = choose_most_loaded([item.curve.fixed for item in curves], peaks)
    files = draw_forces(stem, title, friction, labels, peaks, chosen, run)
    # The film is of the highest level.
    last = chosen[-1]
    motion = preloaded.reduction.assembly.on_whole_mesh(states[last].coefficients.T)
    files += draw_film(
        stem, title, preloaded.model, labels[last], states[last].angular_frequency, motion, peaks[last], run
    )
    document = {
        "curves": [
            {
                "largest_ratio_t_n": {name: line.ratio for name, line in forces.lines.items()},
                "inertia_error": forces.inertia_error,
                "bending_error": forces.bending_error,
            }
            for forces in peaks
        ],
        "rest": _document_at_rest(preloaded),
        "dampers": {
            item.body: {
                "mass_kg": item.mass,
                "stiffness": dict(zip(MOTIONS, map(float, item.stiffness), strict=True)),
                "frequency_hz": list(map(float, item.frequency)),
            }
            for item in preloaded.dampers
        },
    }
    return Extras(files=tuple(files), document=document, text=_format_document(document, labels))


def _document_at_rest(system: PreloadedRig) -> dict[str, dict[str, float]]:
    """Make the document of each contact line at rest: forces [N], closed stations, largest |T| / (mu N) of one [-]."""
    names = [contact.name for contact in system.joined.contacts]
    rest, result = system.static_state, {}
    for line, members in system.joined.lines.items():
        rows = [names.index(name) for name in members]
        result[line] = {
            "normal": float(rest.normal[rows].sum()),
            "tangential": float(np.sum([rest.tangential[row][0] for row in rows])),
            "n_closed": int(np.count_nonzero(rest.normal[rows])),
            "ratio": float(rest.ratio[rows].max()),
        }
    return result


def _format_document(document: Mapping[str, Any], labels: Sequence[str]) -> str:
    """Format the document as tables."""
    rest, dampers, curves = document["rest"], document["dampers"], document["curves"]
    width, label_width = max(map(len, rest)), max(map(len, labels))

    def percent(name: str) -> str:
        return f"{format_number(100 * max(max(curve[name].values()) for curve in curves))} %"

    lines = [
        "Under the dead weights:",
        "",
        f"  {'line':<{width}}   N [N]    T [N]   pressed stations   largest T / mu N of one",
        *(
            f"  {name:<{width}} {line['normal']:7.2f} {line['tangential']:8.2f} {line['n_closed']:18} "
            f"{line['ratio']:25.2f}"
            for name, line in rest.items()
        ),
        "",
        "Dampers as rigid bodies on their contacts, all stuck, the other bodies fixed:",
        "",
        f"  {'motion':<18}" + "".join(f"{body:>24}" for body in dampers),
        *(
            f"  {motion:<18}"
            + "".join(f"{_format_stiffness(item['stiffness'][motion], row):>24}" for item in dampers.values())
            for row, motion in enumerate(MOTIONS)
        ),
        *(
            f"  {f'frequency {row + 1}':<18}"
            + "".join(f"{item['frequency_hz'][row]:21.1f} Hz" for item in dampers.values())
            for row in range(len(MOTIONS))
        ),
        "",
        "Highest points, largest |T| / N of each line:",
        "",
        f"  {'curve':<{label_width}}" + "".join(f"{name:>18}" for name in rest),
        *(
            f"  {label:<{label_width}}" + "".join(f"{curve['largest_ratio_t_n'][name]:18.3f}" for name in rest)
            for label, curve in zip(labels, curves, strict=True)
        ),
        "",
        "Contact forces from load cells (eqs 1 and 2), error at the highest points at most: "
        f"{percent('inertia_error')} by inertia, {percent('bending_error')} by bending of the arms",
        "",
    ]
    return "\n".join(lines)


def _format_stiffness(value: float, row: int) -> str:
    return f"{value / 1e6:.4g} N/um" if row < 3 else f"{value:.4g} N m/rad"
