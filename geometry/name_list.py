"""Names or sentences of which a message shows the first ones."""

from collections.abc import Sequence

#: Names that a message shows.
MAX_NAMES = 3


def join_first_names(names: Sequence[str], separator: str = ", ") -> str:
    """The first names, and how many more there are.

    Parameters
    ----------
    names
        Names, k of them.
    separator
        What stands between two of them.
    """
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"{separator.join(names[:MAX_NAMES])}{more}"
