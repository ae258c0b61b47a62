"""Differences between the numbers and words of two results."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

#: Largest number of differences that are printed.
MAX_DIFFERENCES = 40
#: Largest relative difference that counts as round-off [-].
ROUND_OFF = 1e-12


def find_differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """List the values in which two documents differ, the largest relative difference first.

    Returns
    -------
    Number of values ``compared``, and the list ``different`` of objects with ``key``, ``first`` and ``second``.
    """
    leaves = [dict(_list_leaves(document)) for document in (first, second)]
    keys = [key for key in {**leaves[0], **leaves[1]} if not _is_alike(leaves[0].get(key), leaves[1].get(key))]
    keys.sort(key=lambda key: -_change(leaves[0].get(key), leaves[1].get(key)))
    return {
        "compared": len({**leaves[0], **leaves[1]}),
        "different": [{"key": key, "first": leaves[0].get(key), "second": leaves[1].get(key)} for key in keys],
    }


def describe_differences(document: Mapping[str, Any]) -> list[str]:
    """Format the result of `find_differences` as lines of text."""
    different = document["different"]
    lines = [f"{len(different)} of {document['compared']} values differ"]
    for item in different[:MAX_DIFFERENCES]:
        change = _change(item["first"], item["second"])
        share = "" if change == float("inf") else f"  ({100 * change:.3g} %)"
        lines.append(f"  {item['key']}: {_format_value(item['first'])} | {_format_value(item['second'])}{share}")
    if len(different) > MAX_DIFFERENCES:
        lines.append(f"  and {len(different) - MAX_DIFFERENCES} more: --json lists all")
    return lines


def _list_leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of each number or word of a document."""
    if isinstance(value, Mapping):
        for name, item in value.items():
            yield from _list_leaves(item, f"{key}.{name}" if key else str(name))
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for number, item in enumerate(value):
            yield from _list_leaves(item, f"{key}[{number}]")
    else:
        yield key, value


def _change(first: Any, second: Any) -> float:
    """Relative difference of two numbers; infinity if either value is not a number."""
    if not all(isinstance(value, int | float) for value in (first, second)):
        return float("inf")
    largest = max(abs(first), abs(second))
    return abs(first - second) / largest if largest else 0.0


def _is_alike(first: Any, second: Any) -> bool:
    return bool(first == second) or _change(first, second) <= ROUND_OFF


def _format_value(value: Any) -> str:
    return f"{value:.8g}" if isinstance(value, float) else str(value)
