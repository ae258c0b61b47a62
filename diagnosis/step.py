"""Steps of a long computation: each runs by its name, so that a store can take its result and go on after a stop."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


class RunStep(Protocol):
    """Looks up the stored result of a step, or computes and stores it."""

    def __call__(self, name: str, make: Callable[[], T]) -> T:
        """The result of a step by its name; `make` computes it."""
        ...


def compute_step(name: str, make: Callable[[], T]) -> T:  # noqa: ARG001  # the signature of RunStep
    """Compute a step, and store nothing."""
    return make()


def remember_steps(run_step: RunStep) -> RunStep:
    """Steps that are remembered, so that each runs once."""
    results: dict[str, Any] = {}

    def find(name: str, make: Callable[[], T]) -> T:
        if name not in results:
            results[name] = run_step(name, make)
        result: T = results[name]
        return result

    return find
