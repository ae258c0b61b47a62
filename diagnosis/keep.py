"""Where the steps of a long computation keep what they give, so that it can be interrupted and goes on."""

from collections.abc import Callable
from typing import Protocol, TypeVar

T = TypeVar("T")


class Keep(Protocol):
    """Looks up what a step gave before, or makes it."""

    def __call__(self, name: str, make: Callable[[], T]) -> T:
        """The result of a step by its name; `make` computes it."""
        ...


def computed(name: str, make: Callable[[], T]) -> T:  # noqa: ARG001  # the signature of Keep
    """Keep nothing."""
    return make()
