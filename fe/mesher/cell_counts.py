"""Whether numbers of elements can be meshed with; refused by the name of the field."""

from collections.abc import Iterable, Mapping

from fe.errors import MeshError


def check_counts(body: str, counts: Mapping[str, int], *, even: Iterable[str] = (), why_even: str = "") -> None:
    """Refuse numbers of elements.

    Parameters
    ----------
    body
        What is meshed, for the message.
    counts
        Numbers of elements by the name of their field [-].
    even
        Fields that must be even.
    why_even
        "so that ...", for the message.

    Raises
    ------
    MeshError
        One below 1, or an odd one that must be even.
    """
    for name, value in counts.items():
        if value < 1:
            raise MeshError(f"{body}: {name} = {value} elements: give at least 1")
    for name in even:
        if counts[name] % 2:
            raise MeshError(f"{body}: {name} = {counts[name]} elements: give an even number, {why_even}")
