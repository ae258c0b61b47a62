"""What ``stickslip solve`` says of a rig: rest, dampers and curves, as a table and as a document."""

from typing import Any

from reduction.rigid_body import MOTIONS
from study.kind.rig.solve import SolvedRig


def rig_solve_document(rig: SolvedRig) -> dict[str, Any]:
    """What a rig adds to the document of ``--json``; "curves" is a list, an entry for each curve."""
    return {
        "curves": [
            {
                "largest_ratio_t_n": {name: line.ratio for name, line in forces.lines.items()},
                "inertia_error": forces.inertia_error,
                "bending_error": forces.bending_error,
            }
            for forces in rig.peaks
        ],
        "rest": {line: vars(found) for line, found in rig.rest.items()},
        "dampers": {
            each.body: {
                "mass_kg": each.mass,
                "stiffness": dict(zip(MOTIONS, map(float, each.stiffness), strict=True)),
                "frequency_hz": list(map(float, each.frequency)),
            }
            for each in rig.dampers
        },
    }


def rig_solve_text(rig: SolvedRig) -> str:
    """The same as tables."""
    names = list(rig.rest)
    width = max(map(len, names))
    pairs = "".join(f"{name:>18}" for name in names)
    lines = [
        "Under the dead weights:",
        "",
        f"  {'line':<{width}}   N [N]    T [N]   pressed stations   largest T / mu N of one",
        *(
            f"  {name:<{width}} {line.normal:7.2f} {line.tangential:8.2f} {line.n_closed:18} {line.ratio:25.2f}"
            for name, line in rig.rest.items()
        ),
        "",
        "Dampers as rigid bodies on their contacts, all stuck, beside bodies that do not move:",
        "",
        f"  {'motion':<18}" + "".join(f"{each.body:>24}" for each in rig.dampers),
        *(
            f"  {motion:<18}" + "".join(f"{_stiffness(each.stiffness[row], row):>24}" for each in rig.dampers)
            for row, motion in enumerate(MOTIONS)
        ),
        *(
            f"  {f'frequency {row + 1}':<18}" + "".join(f"{each.frequency[row]:21.1f} Hz" for each in rig.dampers)
            for row in range(len(MOTIONS))
        ),
        "",
        "Highest points, largest |T| / N of each line:",
        "",
        f"  {'curve':<{_label_width(rig)}}{pairs}",
        *(
            f"  {label:<{_label_width(rig)}}" + "".join(f"{forces.lines[name].ratio:18.3f}" for name in names)
            for label, forces in zip(rig.labels, rig.peaks, strict=True)
        ),
        "",
        "Contact forces from load cells (eqs 1 and 2), error at the highest points at most: "
        f"{_percent(rig, 'inertia_error')} by inertia, {_percent(rig, 'bending_error')} by bending of the arms",
        "",
    ]
    return "\n".join(lines)


def _stiffness(value: float, row: int) -> str:
    return f"{value / 1e6:.4g} N/um" if row < 3 else f"{value:.4g} N m/rad"


def _label_width(rig: SolvedRig) -> int:
    return max(map(len, rig.labels))


def _percent(rig: SolvedRig, name: str) -> str:
    return f"{100 * max(max(getattr(forces, name).values()) for forces in rig.peaks):.2g} %"
