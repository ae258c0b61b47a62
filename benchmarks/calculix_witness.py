"""Compare matrices, frequencies and elapsed time with CalculiX on the two shipped blades.

    python benchmarks/calculix_witness.py

Needs the program ccx (Debian package calculix-ccx). About a minute.
"""

import time

import numpy as np

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.calculix_run import run_frequency, run_matrices
from fe.element import HEX8, HEX20, TET10
from fe.material import STEEL
from fe.mesher.blade import mesh_blade
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from fe.modal import modes
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade

if __name__ == "__main__":
    print("| body | element | n | DOFs | mass | stiffness | ten frequencies | ours | CalculiX |\n|" + "---|" * 9)
    for element in (HEX8, HEX20, TET10):
        for n in (1, 3):
            plain = MeshRule(element=element, through_thickness=n, length_ratio=2.36, length_cap=0.005)
            rig = MeshRule(element=element, through_thickness=n, length_ratio=2.4, length_cap=0.02)
            bodies = {"plain": mesh_plain_blade(PlainBlade(), plain), "rig's": mesh_blade(Blade(), rig)}
            for name, mesh in bodies.items():
                start = time.perf_counter()
                mass, stiffness = assemble(mesh, STEEL)
                clamp = mesh.nodes("clamp")
                ours = modes(supported_system(mesh, mass, stiffness, [Support(nodes=clamp)]), 10).frequency
                seconds = time.perf_counter() - start
                fixed = np.column_stack([np.repeat(clamp, 3), np.tile([0, 1, 2], len(clamp))])
                start = time.perf_counter()
                theirs = run_frequency(mesh, STEEL, fixed, 10)
                their_seconds = time.perf_counter() - start
                differences = [
                    abs(a - b).max() / abs(b).max()
                    for a, b in zip((mass, stiffness), run_matrices(mesh, STEEL), strict=True)
                ]
                worst = np.abs(ours / theirs - 1).max()
                digits = " | ".join(f"{value:.0e}" for value in (*differences, worst))
                print(
                    f"| {name} | {element.name} | {n} | {3 * mesh.n_node} | {digits} | {seconds:.1f} s | "
                    f"{their_seconds:.1f} s |",
                    flush=True,
                )
