"""Table 2 and figure 14: the three linear iterations, their starts and their results on this rig.

The paper tunes by hand and states the target of each step. The same steps, done numerically:

1. as it starts; in the paper 8 N/um, a fixed root, 0.2 %;
2. k_t and k_n, in the ratio of the start, for the stuck resonance, and the damping ratio for its width; in the paper
   k_t = k_n, and the root is on springs from here on;
3. the density of the blade for the free resonance; k_t and k_n in the ratio of its own start for the stuck one; the
   damping ratio for both widths, as the geometric mean of the two ratios.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np
from scipy.optimize import brentq

from correlation.model import Model
from geometry.errors import ComputationFailed
from pipeline.store import stage
from study.case.tables import Case
from study.estimate.resonance import MeasuredResonance, find_resonances
from study.kind.rig.table import RigTable
from study.paper.case import CriteriaTable
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters, read_parameters
from study.paper.plan import ByHandPlan, LinearStart
from study.paper.resonance import ModalPeak, find_small_peak
from study.run_context import RunContext

#: Makes the model of some parameters.
Make = Callable[[RigParameters], Model]

#: Stiffnesses between which the stuck resonance is sought [N/m], and relative tolerance [-].
STIFFNESS, NEAR = (1e6, 5e7), 1e-5


@dataclass(frozen=True, kw_only=True)
class LinearFit:
    """Parameters of an iteration, with their resonances and criteria.

    Parameters
    ----------
    parameters
        Parameters; the friction coefficient has no meaning here.
    free, stuck
        Resonances of the model.
    free_met, stuck_met
        Whether the criteria are met; None for the free blade if it was not measured.
    """

    parameters: RigParameters
    free: ModalPeak
    stuck: ModalPeak
    free_met: bool | None
    stuck_met: bool


@dataclass(frozen=True, kw_only=True)
class LinearIteration:
    """A row of Table 2: the result of its start on this rig, and the numerical step."""

    start: LinearFit
    own: LinearFit


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearCalibration:
    """All iterations.

    Parameters
    ----------
    free, stuck
        Measured resonances; None of a free blade that was not measured.
    iterations
        Iterations in their order: three, or two without a free blade.
    """

    free: MeasuredResonance | None
    stuck: MeasuredResonance
    iterations: tuple[LinearIteration, ...]


def calibrate_linear(plan: ByHandPlan, model: PaperModel, mu: float, run: RunContext) -> LinearCalibration:
    """Go through the iterations of Table 2; without a free blade the third is left out.

    Parameters
    ----------
    plan
        Starts and thresholds.
    model
        Makes models of the rig.
    mu
        Friction coefficient of the rest under the dead weights [-].
    run
        Store and progress.

    Raises
    ------
    ComputationFailed
        The campaign has no resonance of the lowest level.
    """
    # The paper's resonance is the largest one in its band.
    peaks = {item.free: item for item in find_resonances(model.campaign) if item.is_largest}
    if False not in peaks:
        raise ComputationFailed(
            "there is no resonance in the tests of the lowest level with dampers: the linear calibration needs it; "
            "measure at frequencies on both sides of it"
        )
    free, stuck = peaks.get(True), peaks[False]
    step = run.step("linear iterations", expected=30)
    fits = step.run(
        fit_linear, plan, model.opened.case, None if free is None else _make_peak(free), _make_peak(stuck), mu, model
    )
    iterations = tuple(LinearIteration(start=start, own=own) for start, own in fits)
    return LinearCalibration(free=free, stuck=stuck, iterations=iterations)


def _make_peak(measured: MeasuredResonance) -> ModalPeak:
    return ModalPeak(frequency=measured.frequency, damping=measured.damping)


@stage("linear iterations of the paper", ignore=("make",))
def fit_linear(
    plan: ByHandPlan, rig: Case[RigTable], free: ModalPeak | None, stuck: ModalPeak, mu: float, make: Make
) -> tuple[tuple[LinearFit, LinearFit], ...]:
    """Each iteration: its start and its result on this rig.

    Parameters
    ----------
    plan
        Starts and thresholds.
    rig
        Case of the rig, on which the models depend.
    free, stuck
        Measured resonances; None of a free blade that was not measured.
    mu
        Friction coefficient [-].
    make
        Makes the model of some parameters.
    """
    start = [_make_start(item, mu, rig) for item in plan.linear]
    second = tune_stiffness(make, replace(start[1], damping=stuck.damping), stuck.frequency)
    own = [start[0], second]
    if free is not None:
        nominal = rig.structure.blade_material.density or rig.structure.material.density
        ratio = plan.linear[-1].kn / plan.linear[-1].kt
        own.append(_tune_third(make, second, free, stuck, nominal=nominal, ratio=ratio))
    return tuple(
        (judge_linear(make, a, free, stuck, plan.criteria), judge_linear(make, b, free, stuck, plan.criteria))
        for a, b in zip(start, own, strict=False)
    )


def _make_start(start: LinearStart, mu: float, rig: Case[RigTable]) -> RigParameters:
    return replace(read_parameters(rig), kt=start.kt, kn=start.kn, mu=mu, damping=start.damping, root=start.root)


def judge_linear(
    make: Make, parameters: RigParameters, free: ModalPeak | None, stuck: ModalPeak, criteria: CriteriaTable
) -> LinearFit:
    """Resonances of some parameters compared with measured ones, and whether the criteria are met."""
    made = make(parameters)
    own_free, own_stuck = (find_small_peak(made, free=item) for item in (True, False))
    return LinearFit(
        parameters=parameters,
        free=own_free,
        stuck=own_stuck,
        free_met=None if free is None else _meets(own_free, free, criteria.free_frequency, criteria.width),
        stuck_met=_meets(own_stuck, stuck, criteria.stuck_frequency, criteria.width),
    )


def _meets(model: ModalPeak, measured: ModalPeak, frequency: float, width: float) -> bool:
    near = abs(model.frequency / measured.frequency - 1) <= frequency
    return near and abs(model.damping / measured.damping - 1) <= width


def tune_stiffness(make: Make, parameters: RigParameters, stuck: float) -> RigParameters:
    """Both contact stiffnesses, at constant ratio, for a stuck resonance [Hz].

    Raises
    ------
    ComputationFailed
        No stiffness gives it.
    """
    ratio = parameters.kn / parameters.kt

    def with_stiffness(logarithm: float) -> RigParameters:
        kt = float(np.exp(logarithm))
        return replace(parameters, kt=kt, kn=ratio * kt)

    def compute_error(logarithm: float) -> float:
        return find_small_peak(make(with_stiffness(logarithm)), free=False).frequency / stuck - 1

    return with_stiffness(
        _solve(compute_error, (log(STIFFNESS[0]), log(STIFFNESS[1])), f"a stuck resonance at {stuck:.5g} Hz")
    )


def _solve(error: Callable[[float], float], ends: tuple[float, float], what: str) -> float:
    if error(ends[0]) * error(ends[1]) > 0:
        raise ComputationFailed(f"no contact stiffness gives {what}: check the levels and the blade of the case")
    return float(brentq(error, ends[0], ends[1], xtol=NEAR))


def _tune_third(
    make: Make, second: RigParameters, free: ModalPeak, stuck: ModalPeak, *, nominal: float, ratio: float
) -> RigParameters:
    """Density for the free resonance, stiffness for the stuck one, damping for both widths."""
    before = find_small_peak(make(second), free=True)
    # The density of the whole blade scales all of its frequencies alike.
    light = replace(second, density=nominal * (before.frequency / free.frequency) ** 2)
    result = tune_stiffness(make, replace(light, kn=light.kt * ratio), stuck.frequency)
    tuned = make(result)
    widths = [find_small_peak(tuned, free=item).damping for item in (True, False)]
    wanted = [result.damping * measured.damping / own for own, measured in zip(widths, (free, stuck), strict=True)]
    return replace(result, damping=sqrt(wanted[0] * wanted[1]))
