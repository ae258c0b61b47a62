"""Compiled functions by their address: they do what the function does, and what does not fit is refused."""

import numpy as np
import pytest
from numba import TypingError

from fe.compiled import compiled
from hbsolve.function_address import caller, find_function_address

ARGUMENTS = (np.zeros((1, 2)), 1.0, np.zeros(1))


@compiled
def add_product(a, b, out):  # type: ignore[no-untyped-def]
    """Adds b times the sum of a."""
    if b < 0.0:
        raise ValueError("b is negative")
    out[0] += b * a.sum()


@compiled
def add_and_tell(a, b, out):  # type: ignore[no-untyped-def]
    """The same, with a result."""
    out[0] += b * a.sum()
    return out[0]


call_address = caller(ARGUMENTS)


@compiled
def call(address, a, b, out):  # type: ignore[no-untyped-def]
    """Calls what is there."""
    call_address(address, (a, b, out))


def test_the_function_at_an_address_is_the_function() -> None:
    address, a, out = find_function_address(add_product, ARGUMENTS), np.arange(6.0).reshape(2, 3), np.ones(1)
    call(address, a, 2.0, out)
    assert out[0] == 1.0 + 2.0 * 15.0


def test_its_error_reaches_the_caller() -> None:
    with pytest.raises(ValueError, match="b is negative"):
        call(find_function_address(add_product, ARGUMENTS), np.ones((1, 1)), -1.0, np.zeros(1))


def test_other_types_and_a_result_are_refused() -> None:
    """Machine code takes what it was compiled for: anything else would be read as that."""
    address = find_function_address(add_product, ARGUMENTS)
    with pytest.raises(TypingError):
        call(address, np.ones((1, 2), dtype=np.float32), 1.0, np.zeros(1))
    with pytest.raises(TypingError):
        call(address, np.ones((1, 2)), 1, np.zeros(1))
    with pytest.raises(TypeError, match="add_and_tell returns float64"):
        find_function_address(add_and_tell, ARGUMENTS)
