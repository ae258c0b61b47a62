"""Small matrices are worked on by one BLAS thread, also where a caller has many and runs several entry points."""

from collections.abc import Iterator

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from fe.blas_threads import one_blas_thread
from fe.dense_modes import compute_dense_modes


def threads() -> list[int]:
    return [info["num_threads"] for info in threadpool_info() if info["internal_api"] == "openblas"]


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    with threadpool_limits(2):
        if set(threads()) != {2}:
            pytest.skip("OpenBLAS was built for one thread")
        yield


def test_one_thread_within_and_the_same_as_before_after() -> None:
    with one_blas_thread():
        assert set(threads()) == {1}
        with one_blas_thread():
            assert set(threads()) == {1}
        assert set(threads()) == {1}  # the inner one does not give back what the outer one took
    assert set(threads()) == {2}


def test_an_error_gives_the_threads_back() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        compute_dense_modes(np.eye(2), -np.eye(2))
    assert set(threads()) == {2}


def test_dense_modes_run_on_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    eigh = scipy.linalg.eigh

    def probe(*args: object, **kwargs: object) -> object:
        seen.extend(threads())
        return eigh(*args, **kwargs)

    monkeypatch.setattr(scipy.linalg, "eigh", probe)
    compute_dense_modes(np.eye(3), np.diag([1.0, 2.0, 3.0]))
    assert set(seen) == {1}
    assert set(threads()) == {2}
