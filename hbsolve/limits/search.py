"""The search for limits over frequency and level, as tasks for any executor and any store.

Frequencies are divided into blocks. A task is one step for one level and one block. Its result depends only on its
arguments, so that an interrupted search continues from the stored results, and gives the same limits with any number of
workers.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from hbsolve.errors import BalanceError
from hbsolve.limits.certificate import Certificate, certify
from hbsolve.limits.local_search import GAIN
from hbsolve.limits.optimum import LimitKey, Optima, is_open
from hbsolve.limits.optimum_continuation import (
    FURTHEST,
    continue_across_gaps,
    continue_from_level,
    continue_to_neighbours,
    find_gaps,
)
from hbsolve.limits.perturbation import perturb
from hbsolve.limits.point import SearchStart
from hbsolve.limits.population import find_first_limits, improve_along
from hbsolve.limits.random_histories import Audit, audit
from hbsolve.limits.task import Runner, SearchTask, make_task_key, split_frequencies
from reduction.array_input import check_whole_number
from reduction.array_type import Real

#: Rounds in which optima are continued across the edges of blocks.
ROUNDS = 8
#: Every fifth frequency is perturbed, beginning with another frequency of the block in each round: neighbours adopt
#: gains.
STRIDE, FIRST_PERTURBED = 5, (2, 4, 0)
PERTURBATIONS = len(FIRST_PERTURBED)
#: Rounds in which optima are continued across gaps between branches.
GAP_ROUNDS = 4


@dataclass(frozen=True, kw_only=True)
class LimitSettings:
    """Effort of a search for limits.

    Raises
    ------
    BalanceError
        A number that is not an integer, or too small.
    """

    population: int = 24
    """Number of slider states that are continued along frequency [-]."""
    sample: int = 100
    """Number of random histories of the audit; 0 for no audit [-]."""
    block: int = 15
    """Number of frequencies of a task: results depend on it, but not on the number of workers [-]."""
    seed: int = 0
    """Seed of random starts, perturbations and histories."""
    perturbations: int = PERTURBATIONS
    """Number of rounds of perturbations after optima were continued from level to level, at most 3 [-]."""
    frequencies: int = 24
    """Least number of frequencies of a search: if fewer are requested, some are added, up to the next resonance
    (`hbsolve.limits.auxiliary_frequencies`); with 1, none are added [-]."""

    def __post_init__(self) -> None:
        for name, least in (
            ("population", 1),
            ("sample", 0),
            ("block", 1),
            ("seed", 0),
            ("perturbations", 0),
            ("frequencies", 1),
        ):
            value = check_whole_number(getattr(self, name), name, BalanceError)
            if value < least:
                raise BalanceError(f"{name} = {value} must be at least {least}")
        if self.perturbations > PERTURBATIONS:
            raise BalanceError(f"perturbations = {self.perturbations} must be at most {PERTURBATIONS}")


@dataclass(frozen=True, kw_only=True, eq=False)
class StagedSearch:
    """Search for limits at all frequencies and levels."""

    run: Runner
    """Runner of the tasks."""
    levels: Sequence[float]
    """Levels of the harmonic force, ascending, shape (l,) [-]."""
    starts: Sequence[Sequence[Real]]
    """Sliders of the population at each level."""
    settings: LimitSettings
    """Effort of the search."""

    @property
    def blocks(self) -> list[range]:
        """Indices of the frequencies of each block."""
        return split_frequencies(len(self.run.angular_frequency), self.settings.block)

    def limits(self) -> tuple[list[Optima], list[dict[int, Audit]], list[dict[LimitKey, Certificate]]]:
        """Optima, audits and certificates of each level."""
        result = self._stage("population", find_first_limits, lambda level, block: (block, self.starts[level]))
        best = [_merge_parts(parts) for parts in result]
        self._improve_all(best)
        audits: list[dict[int, Audit]] = [{} for _ in best]
        if self.settings.sample:
            parts = self._stage(
                "audit", audit,
                lambda level, block: (
                    block, self._near(best[level], block), self.settings.sample,
                    (self.settings.seed, level, block[0], 2),
                ),
            )  # fmt: skip
            audits = [{index: result for part in item for index, result in part[2].items()} for item in parts]
            self._continue_to_neighbours(
                "after audit", best, [self._take(best, level, item) for level, item in enumerate(parts)]
            )
        return best, audits, self._certify(best)

    def limits_from(
        self, chosen: Sequence[Mapping[LimitKey, Sequence[SearchStart]]]
    ) -> tuple[list[Optima], list[dict[LimitKey, Certificate]]]:
        """Optima and certificates of each level, from start motions and sliders at each frequency and side."""

        def near(level: int, block: range) -> tuple[range, dict[LimitKey, Sequence[SearchStart]]]:
            return block, {key: value for key, value in chosen[level].items() if key[0] in block}

        best = [_merge_parts(parts) for parts in self._stage("population", improve_along, near)]
        self._improve_all(best)
        return best, self._certify(best)

    def _improve_all(self, best: list[Optima]) -> None:
        """Continue optima to neighbours, other levels and across gaps, and perturb them."""
        self._continue_to_neighbours("neighbours", best, [set(item) for item in best])
        self._perturb(best, "first perturbations", 1)
        self._continue_over_levels(best)
        self._perturb(best, "perturbations", self.settings.perturbations)
        self._cross_gaps(best)

    def _certify(self, best: list[Optima]) -> list[dict[LimitKey, Certificate]]:
        """Certificate of each optimum, by level."""
        result = self._stage("certificates", certify, lambda level, block: (block, self._near(best[level], block)))
        return [{key: value for part in item for key, value in part.items()} for item in result]

    def _continue_over_levels(self, best: list[Optima]) -> None:
        """Continue optima from each level to the next, down and up again."""
        order = [*reversed(range(len(best))), *range(1, len(best))]
        for number, (source, target) in enumerate(pairwise(order)):
            name = f"level {source} to {target}, {number}"
            tasks = [
                self._task(
                    name, target, continue_from_level,
                    (block, best[target], self.levels[source], best[source]), block,
                )
                for block in self.blocks
            ]  # fmt: skip
            gained = self._take(best, target, self.run("levels", tasks))
            self._continue_to_neighbours(
                f"after {name}", best, [gained if at == target else set() for at in range(len(best))]
            )

    def _perturb(self, best: list[Optima], name: str, rounds: int) -> None:
        """Perturb optima at some frequencies of each block, and at others in further rounds for levels with gains.

        Frequencies at which both limits and the searches from all starts agree within `CLOSED` of
        `hbsolve.limits.optimum` are left out.
        """
        levels = list(range(len(best)))
        for number in range(rounds):
            jobs = []
            for level in reversed(levels):
                for block in self.blocks:
                    chosen = block[min(FIRST_PERTURBED[number], len(block) - 1) :: STRIDE]
                    keys = [key for key in sorted(best[level]) if key[0] in chosen and is_open(best[level], key[0])]
                    seed = (self.settings.seed, level, block[0], 1, number, rounds)
                    if keys:
                        jobs.append((level, block, (self._near(best[level], block), keys, seed)))
            gained = self._improved(best, f"{name}, round {number}", "perturbations", perturb, jobs)
            levels = [level for level in levels if gained[level]]

    def _cross_gaps(self, best: list[Optima]) -> None:
        """Continue optima across gaps between branches, as long as some improve."""
        fresh = [find_gaps(item) for item in best]
        for number in range(GAP_ROUNDS):
            jobs = [
                (level, block, keys)
                for level in reversed(range(len(best)))
                for block in self.blocks
                if (keys := sorted(key for key in fresh[level] if key[0] in block))
            ]
            gained = self._improved(best, f"gaps, round {number}", "gaps", continue_across_gaps, [
                (level, block, (self._near(best[level], block), keys)) for level, block, keys in jobs
            ])  # fmt: skip
            # Without a change there is nothing new to try.
            fresh = [
                {key for key in find_gaps(item) if any((key[0] + away, key[1]) in gain for away in (-1, 0, 1))}
                for item, gain in zip(best, gained, strict=True)
            ]

    def _improved(
        self, best: list[Optima], name: str, stage: str, call: Callable[..., Any],
        jobs: Sequence[tuple[int, range, tuple[Any, ...]]],
    ) -> list[set[LimitKey]]:  # fmt: skip
        """Run a call that returns optima and the keys of improved ones; adopt these and continue them to neighbours."""
        tasks = [self._task(name, level, call, given, block) for level, block, given in jobs]
        gained: list[set[LimitKey]] = [set() for _ in best]
        for (level, block, _), (result, better) in zip(jobs, self.run(stage, tasks), strict=True):
            best[level].update({key: value for key, value in result.items() if key[0] in block})
            gained[level] |= better
        self._continue_to_neighbours(f"after {name}", best, gained)
        return gained

    def _stage(
        self, name: str, call: Callable[..., Any], arguments: Callable[[int, range], tuple[Any, ...]]
    ) -> list[list[Any]]:
        """Run a call for each level and block; results by level."""
        tasks = [
            self._task(name, level, call, arguments(level, block), block)
            for level in reversed(range(len(self.levels)))
            for block in self.blocks
        ]
        results = self.run(name, tasks)
        n = len(self.blocks)
        return [results[n * k : n * (k + 1)] for k in range(len(self.levels))][::-1]

    def _task(
        self, name: str, level: int, call: Callable[..., Any], arguments: tuple[Any, ...], block: range
    ) -> SearchTask:
        return SearchTask(
            key=make_task_key(name, level, block),
            call=call,
            level=self.levels[level],
            arguments=arguments,
        )

    def _near(self, best: Optima, block: range) -> Optima:
        """Optima of a block and of its neighbours in frequency."""
        return {key: value for key, value in best.items() if block.start - FURTHEST <= key[0] < block.stop + FURTHEST}

    def _take(self, best: list[Optima], level: int, parts: Iterable[Any]) -> set[LimitKey]:
        """Adopt the results of the blocks of a level, optima and keys of improved ones; returns these keys."""
        gained: set[LimitKey] = set()
        for block, (result, better, *_) in zip(self.blocks, parts, strict=True):
            best[level].update({key: value for key, value in result.items() if key[0] in block})
            gained |= better
        return gained

    def _continue_to_neighbours(self, name: str, best: list[Optima], fresh: list[set[LimitKey]]) -> None:
        """Continue optima to neighbours, within blocks and across their edges, until none improves."""
        for number in range(ROUNDS):
            jobs = []
            for level, keys in enumerate(fresh):
                for block in self.blocks:
                    near = {key for key in keys if block.start - 1 <= key[0] <= block.stop}
                    if near:
                        jobs.append((level, block, near))
            if not jobs:
                return
            tasks = [
                self._task(
                    f"{name}, round {number}", level, continue_to_neighbours,
                    (block, self._near(best[level], block), sorted(near)), block,
                )
                for level, block, near in jobs
            ]  # fmt: skip
            fresh = [set() for _ in best]
            for (level, block, _), result in zip(jobs, self.run("neighbours", tasks), strict=True):
                for key, optimum in result.items():
                    before = best[level].get(key)
                    best[level][key] = optimum
                    if key[0] in (block.start, block.stop - 1) and (
                        before is None or key[1] * (optimum.value - before.value) > GAIN * abs(before.value)
                    ):
                        fresh[level].add(key)


def _merge_parts(parts: Iterable[Optima]) -> Optima:
    return {key: value for part in parts for key, value in part.items()}
