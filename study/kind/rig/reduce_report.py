"""What ``stickslip reduce`` says of a rig: a table for people, a document for programs."""

from typing import Any

from study.kind.rig.reduce import ReducedRig
from study.reduce.mode_check import check_document, check_sentence
from study.reduce.mode_count import fewer_modes_of_rig


def rig_document(reduced: ReducedRig) -> dict[str, Any]:
    """The document of ``--json``."""
    found = reduced.reduction
    bodies = {
        body: {
            "n_dof": len(rom.free),
            "n_kept": rom.n_boundary,
            "n_mode": rom.n_dof - rom.n_boundary,
            "least_scaled_jacobian": found.least_scaled_jacobian[body],
        }
        for body, rom in found.assembly.bodies.items()
    }
    return {
        "bodies": bodies,
        "n_dof": found.n_dof,
        "n_reduced": found.assembly.n_dof,
        "blade_frequency_hz": list(map(float, reduced.blade_frequency)),
        "stuck_frequency_hz": list(map(float, reduced.stuck_frequency)),
        "energy_share": {kind: list(map(float, share)) for kind, share in reduced.energy_share.items()},
        **(
            {"mode_check": {body: check_document(each) for body, each in reduced.checks.items()}}
            if reduced.checks
            else {}
        ),
        "files": [str(file) for file in reduced.files],
    }


def rig_text(reduced: ReducedRig) -> str:
    """The same as a table."""
    document, found = rig_document(reduced), reduced.reduction
    bodies = document["bodies"]
    total = {name: sum(body[name] for body in bodies.values()) for name in ("n_dof", "n_kept", "n_mode")}
    worst = min(body["least_scaled_jacobian"] for body in bodies.values())
    rows = {**bodies, "all": {**total, "least_scaled_jacobian": worst}}
    stuck = zip(reduced.stuck_frequency, *reduced.energy_share.values(), strict=True)
    checked = [f"  {body}: {check_sentence(each)}" for body, each in reduced.checks.items()]
    if checked:
        checked = ["  checked, of each body more modes than are kept:", *checked, ""]
    return "\n".join(
        [
            f"{document['n_dof']} degrees of freedom reduced to {document['n_reduced']}",
            *fewer_modes_of_rig(found.assembly, reduced.n_mode),
            "",
            "  body              full    kept   modes   least scaled Jacobian",
            *(
                f"  {body:15} {row['n_dof']:6} {row['n_kept']:7} {row['n_mode']:7} {row['least_scaled_jacobian']:23.2f}"
                for body, row in rows.items()
            ),
            "",
            *checked,
            f"  blade without contacts: {', '.join(f'{f:.2f}' for f in reduced.blade_frequency)} Hz",
            "",
            "  all contacts stuck                 kinetic energy in",
            f"  mode     frequency {''.join(f'{kind:>12}' for kind in reduced.energy_share)}",
            *(
                f"  {number:4} {frequency:10.2f} Hz {''.join(f'{100 * share:10.1f} %' for share in shares)}"
                for number, (frequency, *shares) in enumerate(stuck, start=1)
            ),
            "",
            *map(str, reduced.files),
        ]
    )
