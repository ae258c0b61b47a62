"""Harmonic balance works on one BLAS thread, and gives the caller's threads back."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from reduction.jointed_system import JointedSystem


def threads() -> set[int]:
    return {info["num_threads"] for info in threadpool_info() if info["internal_api"] == "openblas"}


def test_a_response_curve_runs_on_one_thread() -> None:
    system = JointedSystem(
        mass=np.eye(1), damping=np.eye(1), stiffness=[[100.0]], joints=[], harmonic_force=[[0], [1.0]]
    )
    balance = HarmonicBalance(system=system, n_harmonic=2)
    seen: set[int] = set()
    with threadpool_limits(2):
        if threads() != {2}:
            pytest.skip("OpenBLAS was built for one thread")
        frequency_response(balance, 5.0, 15.0, report=lambda _done, _whole: seen.update(threads()))
        assert threads() == {2}
    assert seen == {1}
