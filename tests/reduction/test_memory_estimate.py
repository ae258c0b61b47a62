"""The memory of a reduction, estimated before it is taken, against the peak of a process that takes it."""

import subprocess
import sys
from pathlib import Path

import pytest
import scipy.sparse as sp

from fe.assembly import assemble, assemble_compact
from fe.element import HEX20, TET10
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from reduction.errors import RomError
from reduction.memory_estimate import (
    FACTOR,
    LIBRARIES,
    estimate_mesh_memory,
    estimate_reduction_memory,
    estimate_tetrahedra_memory,
    refuse_beyond_memory,
)
from tests.slow import slow

N_MODE, N_NODE = 40, 20

#: Reduces a bar, and prints the estimate and the peak beyond what was there before.
MEASURED = f"""
import re, sys
from pathlib import Path
import numpy as np
import fe.assembly
from fe.boundary import Support, supported_system
from fe.element import ELEMENTS
from fe.mesher.block import Block, mesh_blocks
from fe.material import STEEL
from reduction.craig_bampton import craig_bampton
from reduction.memory_estimate import estimate_reduction_memory
from tests.slow import slow

def held(what):
    return 1024 * int(re.search(what + r":\\s+(\\d+)", Path("/proc/self/status").read_text())[1])

counts = tuple(map(int, sys.argv[3:6]))
block = Block(shape=lambda u, v, w: (2e-3 * counts[0] * u, 2e-3 * counts[1] * v, 2e-3 * counts[2] * w), counts=counts)
mesh = mesh_blocks([block], ELEMENTS[sys.argv[2]])
foot = np.flatnonzero(mesh.points[:, 2] < 1e-9)
system = supported_system(mesh, *getattr(fe.assembly, sys.argv[1])(mesh, STEEL), [Support(nodes=foot)])
free = np.setdiff1d(mesh.corner_nodes(), foot)
directions = tuple(map(int, sys.argv[6]))
rows = {{"kept": system.rows(np.random.default_rng(0).permutation(free)[:{N_NODE}], directions)}}
estimate = estimate_reduction_memory(system.stiffness, len(rows["kept"]), {N_MODE}, is_compact=len(directions) == 3)
before = held("VmRSS")
Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
craig_bampton(system, rows, {N_MODE})
print(estimate, held("VmHWM") - before)
"""


def bar(counts: tuple[int, int, int]) -> Mesh:
    return mesh_blocks([Block(shape=lambda u, v, w: (0.01 * u, 0.01 * v, 0.05 * w), counts=counts)], HEX20)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="Linux alone tells the peak of a process")
@pytest.mark.parametrize(
    ("way", "directions", "cell", "counts"),
    [
        pytest.param("assemble", "012", "tetra10", (7, 7, 10), marks=slow),
        ("assemble_compact", "012", "hexahedron20", (4, 4, 40)),
        pytest.param("assemble_compact", "02", "tetra10", (7, 7, 10), marks=slow),
    ],
)
def test_the_peak_of_a_reduction_is_within_the_stated_factor(
    way: str, directions: str, cell: str, counts: tuple[int, int, int]
) -> None:
    command = [sys.executable, "-c", MEASURED, way, cell, *map(str, counts), directions]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    estimate, measured = map(float, done.stdout.split())
    assert estimate / FACTOR < measured < estimate * FACTOR


def test_the_estimate_of_a_mesh_is_that_of_its_matrices_and_of_the_matrices_themselves() -> None:
    mesh = bar((3, 3, 12))
    mass, stiffness = assemble_compact(mesh, STEEL)
    matrices = (mass.nodes.data, mass.nodes.indices, stiffness.values, stiffness.column)
    expected = estimate_reduction_memory(stiffness, 60, 40) + sum(item.nbytes for item in matrices)
    # Rows of nodes and rows of degrees of freedom may begin at another end.
    assert estimate_mesh_memory(mesh, 60, 40) == pytest.approx(expected, rel=0.05)


def test_the_factor_grows_faster_than_the_system_and_less_for_slender_bodies() -> None:
    def taken(counts: tuple[int, int, int]) -> tuple[float, int]:
        mesh = bar(counts)
        return estimate_mesh_memory(mesh, 0, 0) - LIBRARIES, mesh.n_node

    # None so large that products of our own, whose compiler is counted, would be taken.
    (cube, n_cube), (slender, n_slender), (small, n_small) = map(taken, [(8, 8, 8), (3, 3, 50), (4, 4, 4)])
    assert cube / n_cube > slender / n_slender
    assert cube / n_cube > 1.1 * small / n_small


def test_bodies_that_nothing_joins_are_no_wider_than_all_of_them() -> None:
    one = assemble(bar((2, 2, 10)), STEEL)[1]
    two = sp.csr_array(sp.block_diag([one, one]))
    single, double = (estimate_reduction_memory(item, 0, 0) - LIBRARIES for item in (one, two))
    # Up to a body as wide as both together.
    assert 2 * single * (1 - 1e-12) <= double <= 2**1.75 * single


def test_before_there_is_a_mesh_the_estimate_is_about_that_of_the_mesh() -> None:
    block = Block(shape=lambda u, v, w: (0.02 * u, 0.02 * v, 0.06 * w), counts=(5, 5, 15))
    mesh = mesh_blocks([block], TET10)
    early = estimate_tetrahedra_memory(0.02 * 0.02 * 0.06, 0.06, 0.004, 60, 40)
    # Six tetrahedra of a cube have edges up to 1.7 times its own, and so three quarters of the degrees of freedom.
    assert 0.5 < estimate_mesh_memory(mesh, 60, 40) / early < 1.0


def test_more_than_that_is_refused_with_both_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("reduction.memory_estimate.read_available_memory", lambda: 2e9)
    refuse_beyond_memory(1.9e9, "reducing a bar")
    with pytest.raises(RomError, match=r"reducing a bar takes about 2\.1 GB of memory, but 2 GB are free: take larger"):
        refuse_beyond_memory(2.1e9, "reducing a bar")
