"""One mass on a spring, with a contact line that rubs: the smallest case with all calibration parameters but one."""

from pathlib import Path

import numpy as np

CASE = """\
schema = 2
title = "One mass"
[structure]
kind = "plain"
file = "mass.npz"
[[line]]
name = "wall"
normal = { dof = 1 }
tangent = { dof = 0 }
normal_stiffness = "1 N/um"
tangential_stiffness = "0.3 N/um"
friction_coefficient = 0.5
preload = "4 N"
balanced_preload = true
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "mass"
dof = 0
"""
#: Limits at two frequencies, searched for in seconds.
LIMITS = """\
[limits]
frequencies = ["165 Hz", "170 Hz"]
levels = [2]
population = 2
samples = 0
"""


def write_matrices(folder: Path) -> None:
    """Write its matrices."""
    np.savez(folder / "mass.npz", M=np.diag([1.0, 0.1]), K=np.diag([1e6, 1e6]), C=np.diag([20.0, 5.0]))
