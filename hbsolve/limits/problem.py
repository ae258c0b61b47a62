"""System, objective and box of a search for limits at any frequency and level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.limits.objective import Measure, Objective
from hbsolve.limits.point import LimitPoint
from hbsolve.limits.slider_bounds import SliderBox
from hbsolve.limits.sliders import SliderTable, make_slider_table
from reduction.array_type import Real

Frequencies = Float[Real, " f"]

#: Number of frequencies whose structure is stored: all stages reuse them.
STORED = 400


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitProblem:
    """A search for limits; can be pickled."""

    balance: HarmonicBalance
    """Balance of the system; its level is replaced."""
    objective: Objective
    """Quantity whose limits are sought."""
    box: SliderBox
    """Box of the initial slider states."""
    boxes: Mapping[float, SliderBox] = field(default_factory=dict)
    """Boxes by level, of levels with their own box."""
    sliders: SliderTable = field(init=False, repr=False)
    _known: dict[float, tuple[Condensed, Measure]] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sliders", make_slider_table(self.balance))
        self.objective.check(self.balance)

    def with_reaches(self, levels: Sequence[float], reach: Float[Real, "l s"]) -> "LimitProblem":
        """The same problem with a box for each level; the box of other levels contains all of these."""
        boxes = {float(level): replace(self.box, reach=row) for level, row in zip(levels, reach, strict=True)}
        return replace(self, box=replace(self.box, reach=np.max(reach, axis=0)), boxes=boxes)

    def box_at(self, level: float) -> SliderBox:
        """The box of a level."""
        return self.boxes.get(level, self.box)

    def at(self, angular_frequency: float, level: float) -> LimitPoint:
        """The balance at one frequency and level."""
        if angular_frequency not in self._known:
            if len(self._known) >= STORED:
                self._known.clear()
            condensed = self.balance.at(angular_frequency)
            self._known[angular_frequency] = condensed, self.objective.measure(self.balance, condensed)
        condensed, measure = self._known[angular_frequency]
        balance = self.balance.at_level(level)
        return LimitPoint(
            balance=balance,
            condensed=condensed,
            linear=balance.linear(condensed),
            measure=measure,
            sliders=self.sliders,
            box=self.box_at(level),
        )

    def __getstate__(self) -> dict[str, Any]:
        """State without cached structures, which another process computes itself."""
        return self.__dict__ | {"_known": {}}


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitCurve:
    """A search at one level."""

    problem: LimitProblem
    """System, objective and box."""
    level: float
    """Scale of the harmonic force [-]."""
    angular_frequency: Frequencies
    """All frequencies of the search, ascending, shape (f,) [rad/s]."""

    @property
    def box(self) -> SliderBox:
        """Box of the initial slider states at this level."""
        return self.problem.box_at(self.level)

    def point(self, index: int) -> LimitPoint:
        """The balance at one of the frequencies."""
        return self.problem.at(float(self.angular_frequency[index]), self.level)
