"""Lists of names or sentences in messages, of which only the first are shown."""

from collections.abc import Sequence

#: Largest number of names that a message shows.
MAX_NAMES = 3


def join_first_names(names: Sequence[str], separator: str = ", ") -> str:
    """Join the first names, and add the number of the others.

    Parameters
    ----------
    names
        Names, shape (k,).
    separator
        Text between two names.
    """
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"{separator.join(names[:MAX_NAMES])}{more}"
