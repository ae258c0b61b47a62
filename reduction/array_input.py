"""Checks of numbers and arrays from callers; arrays are copied and read-only."""

from numbers import Number, Real
from operator import index
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from geometry.errors import InputError
from reduction.array_type import Matrix

Entries = TypeVar("Entries", bound=np.generic)

#: Largest relative asymmetry that is accepted as round-off.
ASYMMETRY = 1e-9


def check_array(values: object, what: str, error: type[InputError]) -> Float[NDArray[np.float64], "..."]:
    """Check and copy an array of real numbers; complex numbers without imaginary parts are accepted.

    Parameters
    ----------
    values
        Array or nested lists.
    what
        Name in the message, such as "the mass".
    error
        Class of the error to raise.

    Raises
    ------
    InputError
        A ragged list, a sparse matrix, or an entry that is not a real number; the class is `error`.
    """
    given = _check_numbers(values, what, error)
    if np.iscomplexobj(given) and given.imag.any():
        lost = np.argwhere(given.imag != 0)[0]
        raise error(f"{what} holds {given[tuple(lost)]:g}{_place(lost)}: give real numbers")
    return make_read_only(given.real.astype(np.float64))


def check_complex_array(values: object, what: str, error: type[InputError]) -> Complex[NDArray[np.complex128], "..."]:
    """Check and copy an array of complex numbers; see `check_array`."""
    return make_read_only(_check_numbers(values, what, error).astype(np.complex128))


def check_finite_array(
    values: object, what: str, error: type[InputError], shape: tuple[int, ...], meaning: str = ""
) -> Float[NDArray[np.float64], "..."]:
    """Check and copy an array of finite real numbers of a given shape; see `check_array`.

    Another shape or other entries raise `error`; messages explain the shape by `meaning`, such as ", over all degrees
    of freedom".
    """
    given = check_array(values, what, error)
    if given.shape != shape:
        raise error(f"{what} has shape {given.shape}: give {shape}{meaning}")
    refuse_infinite(given, what, error)
    return given


def refuse_infinite(values: NDArray[Any], what: str, error: type[InputError]) -> None:
    """Refuse an array with an entry that is infinite or NaN."""
    if not np.isfinite(values).all():
        place = np.argwhere(~np.isfinite(values))[0]
        raise error(f"{what} holds {values[tuple(place)]}{_place(place)}: give finite numbers")


def is_symmetric(matrix: Matrix, tolerance: float = ASYMMETRY) -> bool:
    """Whether a matrix is symmetric up to a fraction of its largest entry."""
    skew = np.abs(matrix - matrix.T).max(initial=0.0)
    return not skew > tolerance * np.abs(matrix).max(initial=0.0)  # NaN passes here and is refused elsewhere


def refuse_asymmetric(matrix: Matrix, what: str, error: type[InputError], tolerance: float = ASYMMETRY) -> None:
    """Refuse a matrix that is not symmetric up to a fraction of its largest entry."""
    if not is_symmetric(matrix, tolerance):
        skew = np.abs(matrix - matrix.T)
        i, j = (int(element) for element in np.unravel_index(skew.argmax(), skew.shape))
        raise error(
            f"{what} is not symmetric: entries ({i}, {j}) and ({j}, {i}) are {matrix[i, j]:g} and {matrix[j, i]:g}; "
            "write both halves of it"
        )


def refuse_massless(mass: Matrix, error: type[InputError]) -> None:
    """Refuse a symmetric mass that is not positive definite."""
    try:
        np.linalg.cholesky(mass)  # unlike eigenvalues, not affected by different units
    except np.linalg.LinAlgError:
        lightest = float(np.linalg.eigvalsh(mass)[0])
        raise error(
            f"the mass has the eigenvalue {lightest:.3g} kg: the mass must be positive definite, so give every "
            "degree of freedom a mass or reduce it out"
        ) from None


def check_real_number(value: object, what: str, error: type[InputError]) -> float:
    """Check a real number of Python or NumPy; booleans are refused.

    Parameters
    ----------
    value
        Number to check.
    what
        Name in the message.
    error
        Class of the error to raise.

    Raises
    ------
    InputError
        Any other value; the class is `error`.
    """
    plain = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(plain, bool) or not isinstance(plain, Real):
        raise error(f"{what} = {value!r} must be a real number")
    return float(plain)


def check_finite_number(value: object, what: str, error: type[InputError]) -> float:
    """Check a real number that is neither infinite nor NaN; see `check_real_number`."""
    number = check_real_number(value, what, error)
    if not np.isfinite(number):
        raise error(f"{what} = {number} must be a finite number")
    return number


def check_whole_number(value: object, what: str, error: type[InputError]) -> int:
    """Check an integer of Python or NumPy; booleans and floats such as 5.0 are refused.

    Parameters
    ----------
    value
        Number to check.
    what
        Name in the message.
    error
        Class of the error to raise.

    Raises
    ------
    InputError
        Any other value; the class is `error`.
    """
    try:
        if isinstance(value, bool):
            raise TypeError
        return index(value)  # type: ignore[arg-type]
    except TypeError:
        raise error(f"{what} = {value!r} must be a whole number: give an int") from None


def freeze_arrays(item: object, *names: str, dtype: Any = np.float64) -> None:
    """Replace fields of a frozen data class by read-only copies; with `dtype` None each keeps its type."""
    for name in names:
        object.__setattr__(item, name, make_read_only(np.array(getattr(item, name), dtype=dtype)))


def make_read_only(values: NDArray[Entries]) -> NDArray[Entries]:
    """Make an array read-only in place, and return it."""
    values.setflags(write=False)
    return values


def _check_numbers(values: object, what: str, error: type[InputError]) -> NDArray[np.number]:
    if hasattr(values, "toarray"):
        raise error(f"{what} is a sparse {type(values).__name__}: give a dense array, such as its toarray()")
    try:
        given = np.array(values)
    except ValueError:  # raised by NumPy for a ragged list
        lengths = sorted({len(row) if hasattr(row, "__len__") else 1 for row in values})  # type: ignore[attr-defined]
        raise error(f"{what}: its rows have different lengths {lengths}, give as many numbers in each") from None
    if given.dtype.kind in "biufc":
        return given
    entries = np.array(values, dtype=object)
    for place, entry in np.ndenumerate(entries):
        if not isinstance(entry, Number):
            raise error(f"{what} holds {entry!r}{_place(place)}: give numbers")
    return np.asarray(entries.astype(np.complex128))


def _place(place: tuple[int, ...] | NDArray[np.int64]) -> str:
    numbers = [int(element) for element in place]
    return "" if not numbers else f" at {numbers[0]}" if len(numbers) == 1 else f" at {tuple(numbers)}"
