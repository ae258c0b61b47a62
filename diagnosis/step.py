"""Named steps of a long computation, so that a store can keep their results and resume after an interruption."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


class RunStep(Protocol):
    """Looks up the stored result of a step, or computes and stores it."""

    def __call__(self, name: str, make: Callable[[], T]) -> T:
        """Result of the step with this name; `make` computes it."""
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
