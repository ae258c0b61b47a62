"""Compare the reduced assembly of the stuck rig with CalculiX and unreduced bodies on the same mesh.

    python -m benchmarks.rig_calculix [SIZE_MM ...]

Contact springs connect the nodes of the stations as in the reduced model. Needs the program ccx (Debian package
calculix-ccx); takes some minutes at 2.5 mm.
"""

import sys
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fe.calculix_run import run_frequency
from fe.file.calculix_deck import NodeSpring
from fe.mesh import Mesh
from fe.mesher.body import join_meshes
from geometry.rig import Rig, mating_pairs
from pipeline.cache_folder import default_folder
from pipeline.progress import LineProgress
from pipeline.store import Store
from reduction.line_contact import compute_station_stiffness
from study.case.tables import Case
from study.kind.registry import open_case
from study.kind.rig.contact import make_line_pairs
from study.kind.rig.model import BODIES, FIXED_SETS
from study.kind.rig.reduce import stuck_modes
from study.kind.rig.reduction import reduce_rig
from study.kind.rig.table import RigTable, make_rig_model
from study.shipped_cases import RIG

#: Number of compared frequencies.
N_MODE = 6


def contact_springs(case: Case[RigTable], rig: Rig, whole: Mesh) -> list[NodeSpring]:
    """Springs along normal and both tangents of every station."""
    result = []
    pairs = mating_pairs(rig)
    for pair in make_line_pairs(case, rig):
        line, other = pairs[pair.name].damper_line, pairs[pair.name].other_line
        nodes = whole.node_sets[f"{pair.body}.{line.name}"]
        others = whole.node_sets[f"{pair.other}.{other.name}"]
        for station, (k_n, k_t) in enumerate(compute_station_stiffness(line, pair.stiffness)):
            frame = zip((line.normal[station], *line.tangents[station]), (k_n, k_t, k_t), strict=True)
            result += [
                NodeSpring(
                    node=int(nodes[station]),
                    other=int(others[station]),
                    direction=direction,
                    stiffness=float(stiffness),
                )
                for direction, stiffness in frame
            ]
    return result


def held(whole: Mesh) -> NDArray[np.int64]:
    """Nodes and directions of all supports, shape (k, 2)."""
    nodes = np.unique(
        np.concatenate(
            [whole.nodes(f"{body}.{name}") for body in BODIES for name in FIXED_SETS[body.partition("_")[0]]]
        )
    )
    return np.column_stack([np.repeat(nodes, 3), np.tile([0, 1, 2], len(nodes))])


def main(sizes: list[float]) -> None:
    """Print a table for each size of the elements [mm]."""
    case = open_case(RIG).case
    for size in sizes:
        model = replace(make_rig_model(case), size=1e-3 * size)
        reduction = reduce_rig(model, Store(default_folder()), LineProgress())
        ours = stuck_modes(reduction.assembly, make_line_pairs(case, model.rig), case.structure.contact.sliding)[0][
            :N_MODE
        ]
        whole = join_meshes(reduction.meshes)
        start = time.perf_counter()
        theirs = run_frequency(whole, model.material, held(whole), N_MODE, contact_springs(case, model.rig, whole))
        seconds = time.perf_counter() - start
        print(f"\n{size:g} mm, {3 * whole.n_node} degrees of freedom, CalculiX {seconds:.0f} s\n")
        print("| mode | full, CalculiX [Hz] | reduced [Hz] | apart |\n|---|---|---|---|")
        for number, (full, reduced) in enumerate(zip(theirs, ours, strict=True), start=1):
            print(f"| {number} | {full:.5f} | {reduced:.5f} | {reduced / full - 1:.1e} |")


if __name__ == "__main__":
    main([float(size) for size in sys.argv[1:]] or [5.0, 2.5])
