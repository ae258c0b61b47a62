"""Limits at other forces and preloads.

With less force or more preload, a contact that is at the onset of slip in a limit state has a margin: the state with
the sliders of the limit still exists, but is no longer a limit. The sliders are therefore searched again from this
state, with the balance of the search for the limits, in a box that moves with the state of rest under the preload. The
reading is then computed with a finer balance, as at the limit itself: with it, the static force of a contact in full
slip may change with the force three times as fast as with the few harmonics and samples of the search.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.model_solver import ModelSolver
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import NoSteadyState
from hbsolve.limits.local_search import LimitSide, local_search
from hbsolve.limits.objective import Objective
from hbsolve.limits.point import LimitPoint, TrialState
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.slider_bounds import SliderBox, make_slider_box
from hbsolve.limits.sliders import make_slider_table
from hbsolve.solution import newton_from, solve_at
from hbsolve.state import SteadyState, in_harmonics_of, make_initial_sliders
from hbsolve.steady_state import FEW_STARTS, from_many_starts
from reduction.array_type import Real

Values = Float[NDArray[np.float64], " k"]

#: Forces and preloads at which limits are read, in spans. In full slip, the slope of a static force with the force may
#: be three times as large at the ends as between, which a parabola through three points misses.
SPAN_STEPS = np.array([-1.0, -0.5, 0.5, 1.0])


class SolveEffort(Enum):
    """Effort of a search for a state near a known one."""

    NEWTON_ONLY = auto()
    """Newton's method from the known state."""
    FEW_STARTS = auto()
    """Then also a ramp of the level and a few other starts, which take minutes with many harmonics."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Variant:
    """A model at another force or preload.

    Parameters
    ----------
    model
        Model with its preloads.
    factor
        Factor on the force [-].
    box
        Box of the slider positions.
    """

    model: Model
    factor: float
    box: SliderBox
    _known: dict[tuple[int, int], ModelSolver] = field(init=False, repr=False, default_factory=dict)

    def like(self, balance: HarmonicBalance) -> ModelSolver:
        """Solver with the harmonics and samples of a balance."""
        key = balance.n_harmonic, balance.n_sample
        if key not in self._known:
            model = replace(self.model, n_harmonic=balance.n_harmonic, n_sample=balance.n_sample)
            self._known[key] = ModelSolver.from_model(model, False, None)
        return self._known[key]

    def limit(
        self, balance: HarmonicBalance, objective: Objective, side: LimitSide, known: SteadyState
    ) -> TrialState | None:
        """The limit of this variant, searched from that of the model; None if no state is found.

        Parameters
        ----------
        balance
            Balance of the search.
        objective, side
            Bounded quantity, and side of the limit.
        known
            State of the limit of the model.
        """
        own = self.like(balance).balance.at_level(self.factor * known.level)
        condensed = own.at(known.angular_frequency)
        point = LimitPoint(
            balance=own, condensed=condensed, linear=own.linear(condensed), measure=objective.measure(own, condensed),
            sliders=make_slider_table(own), box=self.box,
        )  # fmt: skip
        settled = point.settle(known.motion, known.initial_slider)
        if settled is None and (near := find_state(own, condensed, known.motion, known.initial_slider)) is not None:
            settled = point.settle(near.motion, near.initial_slider)
        return settled and local_search(point, settled, side)

    def refine(
        self, balance: HarmonicBalance, own: TrialState, known: SteadyState, refined: SteadyState, effort: SolveEffort
    ) -> tuple[ModelSolver, SteadyState | None]:
        """A state with the harmonics and samples of a finer balance, and the solver for it.

        Parameters
        ----------
        balance
            Finer balance.
        own
            State of this variant with few harmonics.
        known, refined
            State of the model with the same few harmonics, and with the finer balance.
        effort
            Effort of the search.
        """
        configuration = self.like(balance)
        finer = configuration.balance.at_level(self.factor * known.level)
        near = refined.motion + in_harmonics_of(finer, own.motion - known.motion)
        return configuration, find_state(finer, finer.at(known.angular_frequency), near, own.initial_slider, effort)


class VariantScale(NamedTuple):
    """Variants with a scaled force or group of preloads."""

    log_ratio: Values
    """Natural logarithms of the factors, ascending, shape (k,) [-]."""
    variants: tuple[Variant, ...]


def make_variants(curve: LimitCurve, model: Model, force_span: float, preload_span: float) -> list[VariantScale]:
    """Scales of the force, if requested, then of each group of preloads.

    Parameters
    ----------
    curve, model
        Search at one level, and its model.
    force_span, preload_span
        Natural logarithm of the largest factors; 0 for no variants [-].
    """

    def with_preload(group: Sequence[str], log_ratio: float) -> Variant:
        changed = model
        for name in group:
            changed = changed.with_preload_ratio(name, float(np.exp(log_ratio)))
        return Variant(model=changed, factor=1.0, box=_shift_search_box(curve, changed))

    def with_force_level(log_ratio: float) -> Variant:
        return Variant(model=model, factor=float(np.exp(log_ratio)), box=curve.box)

    makers = [(force_span, with_force_level)] if force_span else []
    if preload_span:
        makers += [(preload_span, partial(with_preload, group)) for group in model.preload_groups]
    return [VariantScale(span * SPAN_STEPS, tuple(make(item) for item in span * SPAN_STEPS)) for span, make in makers]


def _shift_search_box(curve: LimitCurve, changed: Model) -> SliderBox:
    """The box of a search, moved and widened in the same way as the cone of friction forces at rest."""
    before, omega = curve.problem.balance, float(curve.angular_frequency[0])
    after = HarmonicBalance(system=changed.system, n_harmonic=before.n_harmonic, n_sample=before.n_sample)
    try:
        rest, own = (make_slider_box(balance, balance.at(omega), reach=curve.box.reach) for balance in (before, after))
    except NoSteadyState:
        return curve.box
    return replace(
        curve.box,
        nominal=curve.box.nominal + own.middle - rest.middle,
        reach=np.maximum(curve.box.reach + own.static - rest.static, 0.0),
    )


def find_state(
    balance: HarmonicBalance,
    condensed: Condensed,
    motion: Real,
    slider: Real,
    effort: SolveEffort = SolveEffort.FEW_STARTS,
) -> SteadyState | None:
    """The steady state near a motion, with the harmonics of the balance; None if there is none.

    Parameters
    ----------
    balance, condensed
        Balance at the level, and its structure at the frequency.
    motion
        Coefficients of the joint directions in any number of harmonics, shape (d, nh) [m].
    slider
        Slider positions, shape (s,) [m].
    effort
        Effort of the search; Newton's method is sufficient if the state is known with nearly as many harmonics.
    """
    start, sliders = in_harmonics_of(balance, motion), make_initial_sliders(balance, slider)
    if effort is SolveEffort.NEWTON_ONLY:
        return newton_from(balance, condensed, start, sliders)
    try:
        return solve_at(balance, condensed, start, sliders)
    except NoSteadyState:
        # The state is known with fewer harmonics: either a few starts near it succeed, or none does; all take minutes.
        return from_many_starts(balance, condensed, start, sliders, FEW_STARTS)
