"""A response curve as a stage: a finished curve is stored, an interrupted one is continued from its saved points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import ComputationFailed
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.continuation_parameter import FrequencyPath, LevelPath
from hbsolve.continuation.response import run
from hbsolve.continuation.step import Continuation
from hbsolve.errors import NoSteadyState
from pipeline.checkpoint import Checkpoint
from pipeline.store import stage
from reduction.jointed_system import JointedSystem
from study.solve.amplitude_control import AmplitudeControl

Row = Float[NDArray[np.float64], " r"]
#: Smallest progress at which the time left is reported.
WORTH_REPORTING = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class RequestedCurve:
    """Request of a case for one curve.

    Parameters
    ----------
    parameter
        Parameter that varies along the curve, "frequency" or "level".
    first, last
        Ends of the curve [rad/s, or - for levels].
    fixed
        Constant level or frequency, or controlled amplitude [-, rad/s, or SI].
    step
        Largest step along the curve, in the unit of its ends; None for the solver's choice.
    label
        Label of the curve, such as "level 3" or "40 Hz".
    slider
        Initial slider positions, shape (s,) [m]; springs without tension by default.
    level_power
        Power of the factor Omega^level_power on levels [-].
    control
        Controlled amplitude of a curve over frequency; None for given levels.
    """

    parameter: str
    first: float
    last: float
    fixed: float
    step: float | None
    label: str
    slider: Row | None = None
    level_power: int = 0
    control: AmplitudeControl | None = None


@stage("response curve", ignore=("checkpoint", "report"))
def response_curve(
    system: JointedSystem,
    curve: RequestedCurve,
    harmonics: int,
    n_sample: int,
    checkpoint: Checkpoint | None = None,
    report: Callable[[float, float], None] | None = None,
) -> ResponseBranch:
    """Compute a curve from its first point, or from the last saved point.

    Parameters
    ----------
    system
        System with its loads at level 1.
    curve
        Request of the case.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    checkpoint
        Store of the points computed so far.
    report
        Function that receives the progress along the curve.

    Raises
    ------
    ComputationFailed
        There is no steady state at the first point.
    """
    done = 0.0

    def share(reached: float, way: float) -> None:
        # Progress does not decrease where a curve turns back.
        nonlocal done
        done = max(done, min(reached, way))
        # The first steps are short and include compilation, so that the estimated time left would be far too long.
        if report is not None and done > WORTH_REPORTING * way:
            report(done, way)

    try:
        if curve.control is not None:
            balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, n_sample=n_sample)
            return curve.control.compute_curve(
                balance, curve.first, curve.last, step=curve.step, slider=curve.slider, report=share
            )
        continuation = make_continuation(system, curve, harmonics, n_sample)
        return run(
            continuation, slider=curve.slider, report=share,
            resumed=checkpoint.load() if checkpoint else None, save=checkpoint.save_if_due if checkpoint else None,
        )  # fmt: skip
    except NoSteadyState as error:
        raise ComputationFailed(f"{curve.label}: {error}") from error


def make_continuation(system: JointedSystem, curve: RequestedCurve, harmonics: int, n_sample: int) -> Continuation:
    """Make the continuation of a curve."""
    balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, n_sample=n_sample)
    if curve.parameter == "frequency":
        path = FrequencyPath(balance=balance.at_level(curve.fixed), level_power=curve.level_power)
        return Continuation(path=path, first=curve.first, last=curve.last, step=curve.step)
    scale = curve.fixed**curve.level_power
    return Continuation(
        path=LevelPath(balance=balance, angular_frequency=curve.fixed),
        first=scale * curve.first,
        last=scale * curve.last,
        step=None if curve.step is None else scale * curve.step,
    )
