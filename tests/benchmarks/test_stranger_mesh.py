"""Structures of the strangers: a finer mesh is the same structure."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg

from benchmarks.strangers.skeleton import Plate


@pytest.mark.parametrize("clamped", [(0,), (0, 1)])
def test_a_clamped_edge_is_clamped_between_the_nodes_of_a_coarse_mesh(clamped: tuple[int, ...]) -> None:
    plate = Plate(size=(0.4, 0.3), n_element=(4, 4), section=(300.0, 0.3, 20.0), clamped=clamped, springs={})
    frequency = [
        np.sqrt(scipy.linalg.eigh(mesh.stiffness, mesh.mass, eigvals_only=True)[:3])
        for mesh in (plate.build(1), plate.build(2), plate.build(4))
    ]
    change = [np.abs(finer / coarse - 1).max() for coarse, finer in pairwise(frequency)]
    # The element converges with h^2.
    assert change[1] < change[0] / 3 < 0.02
