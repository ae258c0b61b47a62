"""Arrays of joint data for harmonic balance and time integration."""

from collections.abc import Sequence

import numpy as np

from reduction.array_type import Real, Whole
from reduction.joint_law.registry import Joint


def starts(counts: Sequence[int]) -> Whole:
    """Start index of each group, and the total number as last entry, shape (n + 1,)."""
    return np.concatenate([[0], np.cumsum(np.array(counts, dtype=np.int64))]).astype(np.int64)


def addresses(joints: Sequence[Joint]) -> Whole:
    """Addresses of compiled functions of users in this process, 0 for other joints, shape (n_joint,)."""
    return np.array([0 if joint.function is None else joint.function.address for joint in joints], dtype=np.int64)


def stack_parameters(joints: Sequence[Joint]) -> Real:
    """Parameters of each joint, padded with zeros, shape (n_joint, p) with the largest number of parameters p."""
    rows = np.zeros((len(joints), max((len(joint.parameter_names) for joint in joints), default=0)))
    for row, joint in zip(rows, joints, strict=True):
        row[: len(joint.parameter_names)] = joint.parameter_values
    return rows
