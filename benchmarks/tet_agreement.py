"""Compare frequencies of the rig in tetrahedra and in bricks: blade alone, and rig with contacts stuck.

    OMP_NUM_THREADS=1 python -m benchmarks.tet_agreement [SIZE_IN_MM]

Bricks have their contact stations on corner nodes. There are two kinds of tetrahedra: cut from the bricks of the same
mesher, also with stations on corner nodes, and from fTetWild, which uses CAD faces only. There, stations lie anywhere
on the faces of cells, and become coordinates by a change of variables (`fe.station_coordinates`).
"""

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.dense_modes import compute_dense_modes
from fe.face_integral import integrate_areas, integrate_volume
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.tetrahedra import TetRule, mesh_solid
from fe.modal import modes
from fe.station_coordinates import (
    StationCoordinates,
    make_station_coordinates,
)
from geometry.rig import rig_parts
from reduction.assembly import ReducedAssembly
from reduction.craig_bampton import craig_bampton
from reduction.joined_bodies import join_bodies
from reduction.rom import ReducedModel
from study.case.tables import Case
from study.kind.registry import open_case
from study.kind.rig.contact import make_line_pairs
from study.kind.rig.model import BODIES, FIXED_SETS, LINES, RigModel, find_mirror_image, with_excitation
from study.kind.rig.reduction import make_supported_body, mirror_model
from study.kind.rig.table import RigTable, make_rig_model
from study.shipped_cases import RIG

#: Size of the cells at the contact lines and the root, relative to the size elsewhere [-].
FINER = {"groove_positive": 0.5, "groove_negative": 0.5, "clamp": 0.7, "groove": 0.5}
#: Number of fixed-interface modes of each body, and of compared frequencies.
N_MODE, COMPARED = 30, 8
#: Largest permitted relative difference of the first driven stuck frequency [-].
ALLOWED = 3e-3

#: Smallest motion at the excitation of a driven mode, relative to the largest [-]: dampers roll at lower frequencies
#: than the first mode of the blade.
SEEN = 0.01

Bodies = dict[str, tuple[Mesh, StationCoordinates | None]]


def from_mapped(model: RigModel) -> Bodies:
    """Meshes with stations on nodes, of bodies that are no mirror image."""
    made = model.meshed()
    return {
        body: (mesh, made.coordinates.get(body))
        for body, mesh in made.meshes.items()
        if find_mirror_image(body) is None
    }


def from_tetwild(model: RigModel, size: float) -> Bodies:
    """Mesh the CAD solids, and print one line of checks for each."""
    result: Bodies = {}
    for body, part in rig_parts(model.rig).items():
        if find_mirror_image(body) is not None:
            continue
        start = time.perf_counter()
        near = {name: part_of * size for name, part_of in FINER.items() if name in part.faces}
        mesh = mesh_solid(part, TetRule(size=size, near=near))
        spent = time.perf_counter() - start
        faces = LINES[body.partition("_")[0]]
        lines = {name: line.stations for name, line in part.contact_lines.items() if name in faces}
        place = make_station_coordinates(mesh, lines, faces, fixed=FIXED_SETS[body.partition("_")[0]])
        if body == "blade":
            place = with_excitation(place, model.rig)
        area = max(
            abs(integrate_areas(mesh, mesh.face_sets[name]).sum() / part.faces[name].area - 1) for name in part.faces
        )
        quality = measure_cell_quality(mesh)
        print(
            f"| {body} | {mesh.n_cell} | {3 * mesh.n_node} | {quality.scaled_jacobian.min():.2f} | "
            f"{quality.determinant_ratio.min():.2f} | {area:.1e} | {integrate_volume(mesh) / part.volume - 1:+.1e} | "
            f"{spent:.0f} |",
            flush=True,
        )
        result[body] = (place.mesh, place)
    return result


def reduced(model: RigModel, body: str, mesh: Mesh, place: StationCoordinates | None) -> ReducedModel:
    """Craig-Bampton reduction with all named nodes as boundary."""
    mass, stiffness = assemble(mesh, model.material)
    if place is not None:
        mass, stiffness = place.matrix(mass), place.matrix(stiffness)
    system = make_supported_body(mesh, body, mass, stiffness)
    rom = craig_bampton(system, {name: system.rows(nodes) for name, nodes in mesh.node_sets.items()}, N_MODE)
    return rom if place is None else replace(rom, recovery=place.displacement(system, rom.recovery))


def blade_frequencies(model: RigModel, mesh: Mesh) -> NDArray[np.float64]:
    """Frequencies of the clamped blade without contacts [Hz]."""
    clamp = [Support(nodes=mesh.nodes("clamp"))]
    return modes(supported_system(mesh, *assemble(mesh, model.material), clamp), COMPARED).frequency


def stuck_frequencies(case: Case[RigTable], model: RigModel, bodies: Bodies) -> tuple[NDArray[np.float64], int]:
    """Frequencies of the rig with all contacts stuck [Hz], and index of the first driven by a force on the blade."""
    roms = {body: reduced(model, body, *bodies[body]) for body in bodies}
    every = {
        body: roms[body] if body in roms else mirror_model(roms[find_mirror_image(body) or ""], body) for body in BODIES
    }
    assembly = ReducedAssembly(bodies=every)
    stuck = join_bodies(assembly, make_line_pairs(case, model.rig)).stuck
    result = compute_dense_modes(assembly.mass, stuck)
    driven = np.abs(result.shapes[assembly.rows("blade", "excitation", 1)] / np.sqrt(result.mu))[0]
    first = np.flatnonzero(driven[:COMPARED] > SEEN * driven[:COMPARED].max())[0]
    return result.frequency[:COMPARED], int(first)


def main(size: float) -> None:
    case = open_case(RIG).case
    bricks = make_rig_model(case)
    kinds: Mapping[str, Callable[[], Bodies]] = {
        "hex20": lambda: from_mapped(bricks),
        "tet10 cut from them": lambda: from_mapped(replace(bricks, element="tet10")),
        "tet10 by fTetWild": lambda: from_tetwild(bricks, size),
    }
    print(f"Bricks of {1e3 * bricks.size:g} mm; fTetWild's cells of {1e3 * size:g} mm, half as long at the contacts.\n")
    print("| body | cells | degrees of freedom | scaled Jacobian | det J / mean | worst area | volume | s |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    bodies = {kind: make() for kind, make in kinds.items()}
    blade = {kind: blade_frequencies(bricks, result["blade"][0]) for kind, result in bodies.items()}
    stuck = {kind: stuck_frequencies(case, bricks, result) for kind, result in bodies.items()}
    for title, result in (("clamped blade", blade), ("rig, contacts stuck", {k: v for k, (v, _) in stuck.items()})):
        print(f"\n| {title} | " + " | ".join(f"{kind} [Hz] | apart" for kind in result) + " |")
        print("|---" * (1 + 2 * len(result)) + "|")
        for number, expected in enumerate(result["hex20"]):
            row = " | ".join(f"{item[number]:.3f} | {item[number] / expected - 1:+.2e}" for item in result.values())
            print(f"| {number + 1} | {row} |", flush=True)
    first = stuck["hex20"][1]
    apart = stuck["tet10 by fTetWild"][0][first] / stuck["hex20"][0][first] - 1
    print(f"\nFirst stuck frequency that a force on the blade drives: number {first + 1}, {apart:+.2e} apart.")
    if abs(apart) > ALLOWED:
        sys.exit(f"the two elements are more than {ALLOWED:.1%} apart")


if __name__ == "__main__":
    main(1e-3 * float(sys.argv[1]) if len(sys.argv) > 1 else 4e-3)
