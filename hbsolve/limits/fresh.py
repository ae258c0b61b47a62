"""A test of limits that are frozen, by histories that had no part in them."""

from collections.abc import Callable, MutableMapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.result import ResponseLimits
from hbsolve.limits.sampled import sampled_states
from hbsolve.limits.task import Runner, SearchTask, StageProgress


@dataclass(frozen=True, kw_only=True, eq=False)
class FreshHistories:
    """Random histories against limits.

    Parameters
    ----------
    value
        Of the objective, NaN where no state was found, shape (l, f, n).
    excess
        How far each lies outside, relative to the limit; negative inside, shape (l, f, n) [-].
    """

    value: Float[NDArray[np.float64], "l f n"]
    excess: Float[NDArray[np.float64], "l f n"]

    def share_outside(self, by: float) -> float:
        """Share of the states that lie outside by more than this share of the limit [-]."""
        found = self.excess[np.isfinite(self.excess)]
        return float((found > by).mean()) if found.size else 0.0


def fresh_histories(
    problem: LimitProblem,
    limits: ResponseLimits,
    count: int,
    *,
    seed: int,
    store: MutableMapping[str, Any] | None = None,
    executor: Executor | None = None,
    progress: Callable[[StageProgress], None] | None = None,
) -> FreshHistories:
    """Sample histories in the same box, swept over the frequencies of the limits.

    Parameters
    ----------
    problem, limits
        As `hbsolve.limits.response_limits.response_limits` took and gave them.
    count
        Histories [-].
    seed
        Another one than that of the search.
    store, executor, progress
        As there; one task a level.
    """
    run = Runner(
        problem=problem, token=uuid4().hex, store={} if store is None else store, executor=executor,
        progress=progress or (lambda _: None),
    )  # fmt: skip
    numbers = range(len(limits.angular_frequency))
    tasks = [
        SearchTask(
            key=f"fresh histories, level {number}",
            call=sampled_states,
            arguments=(float(level), limits.angular_frequency, numbers, count, (seed, number, 3)),
        )
        for number, level in enumerate(limits.level)
    ]
    value = np.array([states.value for states in run("fresh histories", tasks)])
    size = np.abs(limits.value)[..., None]
    excess = np.maximum((value - limits.upper[..., None]) / size[1], (limits.lower[..., None] - value) / size[0])
    return FreshHistories(value=value, excess=excess)
