"""The search for limits over frequency and level, as tasks that any executor may run and any store may keep.

Frequencies are cut into blocks. A task is one step for one level and one block; what it returns depends on its
arguments alone, so that a search which finds some of its results in the store continues where it was interrupted, and
comes out the same with any number of workers.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from hbsolve.errors import BalanceError
from hbsolve.limits.certificate import Certificate, certify
from hbsolve.limits.exchange import FURTHEST, at_a_gap, bridge, exchange, from_level
from hbsolve.limits.local_search import GAIN
from hbsolve.limits.optimum import Best, Key, is_open
from hbsolve.limits.perturbation import perturb
from hbsolve.limits.point import SearchStart
from hbsolve.limits.population import first_limits, improved_along
from hbsolve.limits.random_histories import Audit, audit
from hbsolve.limits.task import Runner, SearchTask
from reduction.array_input import whole_number
from reduction.array_type import Real

#: Rounds in which blocks hand optima across their edges.
ROUNDS = 8
#: Kicks go to each fifth frequency, in each round from another of a block's first ones: neighbours hand on what gains.
KICK_STRIDE, KICKED_FROM = 5, (2, 4, 0)
KICKS = len(KICKED_FROM)
#: Rounds in which gaps between branches are tried.
BRIDGES = 4


@dataclass(frozen=True, kw_only=True)
class LimitSettings:
    """How hard limits are searched for.

    Raises
    ------
    BalanceError
        A number that is not whole, or too small.
    """

    population: int = 24
    """Slider states that are continued along frequency [-]."""
    sample: int = 100
    """Random histories of the audit; 0 for none [-]."""
    block: int = 15
    """Frequencies of a task: results do depend on it, but not on the number of workers [-]."""
    seed: int = 0
    """Of random starts, kicks and histories."""
    kicks: int = KICKS
    """Rounds of kicks after levels have handed on their optima, at most 3 [-]."""
    frequencies: int = 24
    """Least number of frequencies of a search: where fewer are asked for it adds some, as far as the next resonance
    (`hbsolve.limits.companions`); 1 adds none [-]."""

    def __post_init__(self) -> None:
        for name, least in (
            ("population", 1),
            ("sample", 0),
            ("block", 1),
            ("seed", 0),
            ("kicks", 0),
            ("frequencies", 1),
        ):
            value = whole_number(getattr(self, name), name, BalanceError)
            if value < least:
                raise BalanceError(f"{name} = {value} must be {least} at least")
        if self.kicks > KICKS:
            raise BalanceError(f"kicks = {self.kicks} must be {KICKS} at most")


@dataclass(frozen=True, kw_only=True, eq=False)
class StagedSearch:
    """Limits at all frequencies and levels."""

    run: Runner
    """Runner of its tasks."""
    levels: Sequence[float]
    """Ascending, shape (l,) [-]."""
    starts: Sequence[Sequence[Real]]
    """The population's sliders at each level."""
    settings: LimitSettings
    """How hard to search."""

    @property
    def blocks(self) -> list[range]:
        """Numbers of the frequencies of each block."""
        count = len(self.run.angular_frequency)
        edges = [*range(0, count, self.settings.block), count]
        return [range(first, last) for first, last in pairwise(edges)]

    def limits(self) -> tuple[list[Best], list[dict[int, Audit]], list[dict[Key, Certificate]]]:
        """Optima, audits and certificates of each level."""
        result = self._stage("population", first_limits, lambda level, numbers: (numbers, self.starts[level]))
        best = [_merged(parts) for parts in result]
        self._developed(best)
        audits: list[dict[int, Audit]] = [{} for _ in best]
        if self.settings.sample:
            parts = self._stage(
                "audit", audit,
                lambda level, numbers: (
                    numbers, self._near(best[level], numbers), self.settings.sample,
                    (self.settings.seed, level, numbers[0], 2),
                ),
            )  # fmt: skip
            audits = [{at: result for part in item for at, result in part[2].items()} for item in parts]
            self._exchanged("after audit", best, [self._take(best, level, item) for level, item in enumerate(parts)])
        return best, audits, self._certified(best)

    def limits_from(
        self, chosen: Sequence[Mapping[Key, Sequence[SearchStart]]]
    ) -> tuple[list[Best], list[dict[Key, Certificate]]]:
        """Optima and certificates of each level, searched for from motions and sliders at each frequency and side."""

        def near(level: int, numbers: range) -> tuple[range, dict[Key, Sequence[SearchStart]]]:
            return numbers, {key: value for key, value in chosen[level].items() if key[0] in numbers}

        best = [_merged(parts) for parts in self._stage("population", improved_along, near)]
        self._developed(best)
        return best, self._certified(best)

    def _developed(self, best: list[Best]) -> None:
        """Hand optima to neighbours and other levels, kick them, and carry them over gaps."""
        self._exchanged("neighbours", best, [set(item) for item in best])
        self._kicked(best, "first kicks", 1)
        self._levels(best)
        self._kicked(best, "kicks", self.settings.kicks)
        self._bridged(best)

    def _certified(self, best: list[Best]) -> list[dict[Key, Certificate]]:
        """What is known of each optimum, by level."""
        result = self._stage(
            "certificates", certify, lambda level, numbers: (numbers, self._near(best[level], numbers))
        )
        return [{key: value for part in item for key, value in part.items()} for item in result]

    def _levels(self, best: list[Best]) -> None:
        """Hand optima from each level to the next, down and up again."""
        order = [*reversed(range(len(best))), *range(1, len(best))]
        for number, (source, target) in enumerate(pairwise(order)):
            name = f"level {source} to {target}, {number}"
            tasks = [
                self._task(
                    name, target, from_level,
                    (numbers, best[target], self.levels[source], best[source]), numbers,
                )
                for numbers in self.blocks
            ]  # fmt: skip
            gained = self._take(best, target, self.run("levels", tasks))
            self._exchanged(f"after {name}", best, [gained if at == target else set() for at in range(len(best))])

    def _kicked(self, best: list[Best], name: str, rounds: int) -> None:
        """Kick optima at some frequencies of each block; once more at others in levels where some gained.

        Where both limits are one and searches from all starts have ended alike there is nothing to gain.
        """
        levels = list(range(len(best)))
        for number in range(rounds):
            jobs = []
            for level in reversed(levels):
                for numbers in self.blocks:
                    chosen = numbers[min(KICKED_FROM[number], len(numbers) - 1) :: KICK_STRIDE]
                    keys = [key for key in sorted(best[level]) if key[0] in chosen and is_open(best[level], key[0])]
                    seed = (self.settings.seed, level, numbers[0], 1, number, rounds)
                    if keys:
                        jobs.append((level, numbers, (self._near(best[level], numbers), keys, seed)))
            gained = self._improved(best, f"{name}, round {number}", "kicks", perturb, jobs)
            levels = [level for level in levels if gained[level]]

    def _bridged(self, best: list[Best]) -> None:
        """Carry optima over gaps between branches, as long as some gain."""
        fresh = [at_a_gap(item) for item in best]
        for number in range(BRIDGES):
            jobs = [
                (level, numbers, keys)
                for level in reversed(range(len(best)))
                for numbers in self.blocks
                if (keys := sorted(key for key in fresh[level] if key[0] in numbers))
            ]
            gained = self._improved(best, f"gaps, round {number}", "gaps", bridge, [
                (level, numbers, (self._near(best[level], numbers), keys)) for level, numbers, keys in jobs
            ])  # fmt: skip
            # Where nothing has changed there is nothing new to try.
            fresh = [
                {key for key in at_a_gap(item) if any((key[0] + away, key[1]) in gain for away in (-1, 0, 1))}
                for item, gain in zip(best, gained, strict=True)
            ]

    def _improved(
        self, best: list[Best], name: str, stage: str, call: Callable[..., Any],
        jobs: Sequence[tuple[int, range, tuple[Any, ...]]],
    ) -> list[set[Key]]:  # fmt: skip
        """Run a call that returns optima and which of them improved, take them over and hand them on."""
        tasks = [self._task(name, level, call, given, numbers) for level, numbers, given in jobs]
        gained: list[set[Key]] = [set() for _ in best]
        for (level, numbers, _), (result, better) in zip(jobs, self.run(stage, tasks), strict=True):
            best[level].update({key: value for key, value in result.items() if key[0] in numbers})
            gained[level] |= better
        self._exchanged(f"after {name}", best, gained)
        return gained

    def _stage(
        self, name: str, call: Callable[..., Any], arguments: Callable[[int, range], tuple[Any, ...]]
    ) -> list[list[Any]]:
        """Run a call for each level and block; results by level."""
        tasks = [
            self._task(name, level, call, arguments(level, numbers), numbers)
            for level in reversed(range(len(self.levels)))
            for numbers in self.blocks
        ]
        results = self.run(name, tasks)
        n = len(self.blocks)
        return [results[n * k : n * (k + 1)] for k in range(len(self.levels))][::-1]

    def _task(
        self, name: str, level: int, call: Callable[..., Any], arguments: tuple[Any, ...], numbers: range
    ) -> SearchTask:
        return SearchTask(
            key=f"{name}; level {level}, frequencies {numbers.start} to {numbers.stop - 1}",
            call=call,
            level=self.levels[level],
            arguments=arguments,
        )

    def _near(self, best: Best, numbers: range) -> Best:
        """Optima of a block and of its neighbours in frequency."""
        return {
            key: value for key, value in best.items() if numbers.start - FURTHEST <= key[0] < numbers.stop + FURTHEST
        }

    def _take(self, best: list[Best], level: int, parts: Iterable[Any]) -> set[Key]:
        """Take over what blocks of a level return, first their own optima, then those of them that improved."""
        gained: set[Key] = set()
        for numbers, (result, better, *_) in zip(self.blocks, parts, strict=True):
            best[level].update({key: value for key, value in result.items() if key[0] in numbers})
            gained |= better
        return gained

    def _exchanged(self, name: str, best: list[Best], fresh: list[set[Key]]) -> None:
        """Hand optima to neighbours, within blocks and across their edges, until none improves."""
        for number in range(ROUNDS):
            jobs = []
            for level, keys in enumerate(fresh):
                for numbers in self.blocks:
                    near = {key for key in keys if numbers.start - 1 <= key[0] <= numbers.stop}
                    if near:
                        jobs.append((level, numbers, near))
            if not jobs:
                return
            tasks = [
                self._task(
                    f"{name}, round {number}", level, exchange,
                    (numbers, self._near(best[level], numbers), sorted(near)), numbers,
                )
                for level, numbers, near in jobs
            ]  # fmt: skip
            fresh = [set() for _ in best]
            for (level, numbers, _), result in zip(jobs, self.run("neighbours", tasks), strict=True):
                for key, optimum in result.items():
                    before = best[level].get(key)
                    best[level][key] = optimum
                    if key[0] in (numbers.start, numbers.stop - 1) and (
                        before is None or key[1] * (optimum.value - before.value) > GAIN * abs(before.value)
                    ):
                        fresh[level].add(key)


def _merged(parts: Iterable[Best]) -> Best:
    return {key: value for part in parts for key, value in part.items()}
