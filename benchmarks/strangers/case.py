"""Writes a blueprint as a case file with its matrices, as a user would."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy.linalg

from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.skeleton import Skeleton
from reduction.file.npz import write_npz

#: Stated standard deviations: of each natural frequency (at least this), and of the compliance of the lines [-].
FREQUENCY, COMPLIANCE = 2e-3, 5e-3
#: Number of modes in the mesh study, whose change of frequency is stated if it exceeds `FREQUENCY`.
STUDIED = 6


def write_case(plan: Blueprint, folder: Path, name: str, refine: int = 1, refined: Sequence[str] = ()) -> Path:
    """Write NAME.toml and NAME.npz with a mesh that is `refine` times as fine.

    Parameters
    ----------
    plan
        Structure.
    folder, name
        Folder, and name of both files.
    refine
        Refinement of the mesh.
    refined
        Files of finer cases to which the case refers.
    """
    skeleton = plan.mesh.build(refine)
    arrays = {
        "M": skeleton.mass, "C": plan.damping(skeleton), "K": skeleton.stiffness, **_dofs(skeleton),
    }  # fmt: skip
    text = [f'schema = 2\ntitle = "{plan.kind}"\n[structure]\nkind = "plain"\nfile = "{name}.npz"\n']
    text += [f'[[place]]\nname = "{place}"\ndof = {skeleton.number(spot)}\n' for place, spot in plan.places.items()]
    for line, contacts in plan.lines.items():
        arrays[f"{line}_normal"] = np.array([skeleton.row(contact.normal) for contact in contacts])
        arrays[f"{line}_tangent"] = np.array([skeleton.row(contact.tangent) for contact in contacts])
        text.append(
            f'[[line]]\nname = "{line}"\nnormal = {{ row = "{line}_normal" }}\ntangent = {{ row = "{line}_tangent" }}\n'
            f"normal_stiffness = {_list([item.normal_stiffness for item in contacts], 'N/m')}\n"
            f"tangential_stiffness = {_list([item.tangential_stiffness for item in contacts], 'N/m')}\n"
            f"friction_coefficient = {[item.friction_coefficient for item in contacts]}\n"
            f"preload = {_list([item.preload for item in contacts], 'N')}\n"
            f"gap = {_list([item.gap for item in contacts], 'm')}\nbalanced_preload = true\n"
        )
    for joint, jenkins in plan.jenkins.items():
        arrays[joint] = skeleton.row(jenkins.motion)
        text.append(
            f'[[joint]]\nkind = "jenkins"\nname = "{joint}"\nrow = "{joint}"\n'
            f'tangential_stiffness = "{jenkins.stiffness!r} N/m"\nlimit_force = "{jenkins.limit!r} N"\n'
        )
    for joint, (place, stiffness) in plan.cubic.items():
        text.append(
            f'[[joint]]\nkind = "cubic"\nname = "{joint}"\nplace = "{place}"\nstiffness = "{stiffness!r} N/m^3"\n'
        )
    text.append(f'[[load]]\nplace = "{plan.drive}"\n')
    text.append(
        f'[numerical_error]\nfrequency = {_study_mesh(plan):.3g}\ncompliance = {COMPLIANCE}\nshares = "0 %"\n'
        f"refined = {json.dumps(list(refined))}\n"
    )
    write_npz(folder / f"{name}.npz", arrays)
    (folder / f"{name}.toml").write_text("\n".join(text), encoding="utf-8")
    return folder / f"{name}.toml"


def _study_mesh(plan: Blueprint) -> float:
    """Root mean square change of the first natural frequencies by the finer mesh, at least `FREQUENCY` [-]."""
    meshes = [plan.mesh.build(refine) for refine in (1, plan.finer)]
    squared = [scipy.linalg.eigh(item.stiffness, item.mass, eigvals_only=True)[:STUDIED] for item in meshes]
    number = min(map(len, squared))
    change = np.sqrt(squared[1][:number] / squared[0][:number]) - 1
    return max(FREQUENCY, float(np.sqrt(np.mean(change**2))))


def _dofs(skeleton: Skeleton) -> dict[str, np.ndarray]:
    """Table of the degrees of freedom; each body and point is one node."""
    nodes = list(dict.fromkeys((spot.body, spot.point) for spot in skeleton.spots))
    return {
        "dof_body": np.array([spot.body for spot in skeleton.spots]),
        "dof_node": np.array([nodes.index((spot.body, spot.point)) for spot in skeleton.spots]),
        "dof_direction": np.array([spot.direction for spot in skeleton.spots]),
        "dof_coordinates": np.array([spot.point for spot in skeleton.spots]),
    }


def _list(values: Sequence[float], unit: str) -> str:
    return "[" + ", ".join(f'"{value!r} {unit}"' for value in values) + "]"
