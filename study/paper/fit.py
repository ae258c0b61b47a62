"""Numerical fit of the parameters that the paper tunes by hand: their bands contain the families most tightly.

The fit minimises the score of `diagnosis.fit.family_target` over the band that some friction histories reach, plus a
prior around the start.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.fit.family_fit import MapOver, fit_limits
from diagnosis.fit.family_target import FamilyLimits, FamilyTarget
from pipeline.store import stage
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import RigParameters

Values = Float[NDArray[np.float64], " p"]


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """How a parameter is tuned.

    Parameters
    ----------
    step
        Significant step [unit of the parameter].
    deviation
        Standard deviation of the prior around the start [unit of the parameter].
    """

    step: float
    deviation: float

    def scale(self, factor: float) -> "Tuning":
        """The same in a unit that is smaller by a factor."""
        return Tuning(step=factor * self.step, deviation=factor * self.deviation)


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterScale:
    """Parameters that are tuned, and in which steps.

    Parameters
    ----------
    start
        Parameters to start from, the centre of their prior.
    tuned
        Tuned parameters by name.
    """

    start: RigParameters
    tuned: Mapping[str, Tuning]

    @property
    def prior(self) -> Values:
        """Standard deviations of the prior, shape (p,) [steps]."""
        return np.array([item.deviation / item.step for item in self.tuned.values()])

    def compose(self, scaled: Values) -> RigParameters:
        """Parameters at a distance from the start in steps, shape (p,) [-]."""
        moved = zip(self.tuned.items(), scaled, strict=True)
        return replace(
            self.start, **{name: float(getattr(self.start, name) + item.step * by) for (name, item), by in moved}
        )

    def to_steps(self, parameters: RigParameters) -> Values:
        """Distance of parameters from the start in steps, shape (p,) [-]."""
        return np.array(
            [(getattr(parameters, name) - getattr(self.start, name)) / item.step for name, item in self.tuned.items()]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterFit:
    """A fit of some parameters.

    Parameters
    ----------
    scale
        What was tuned.
    parameters
        Best parameters.
    before, after
        Score at the start and at the end, prior included [-].
    """

    scale: ParameterScale
    parameters: RigParameters
    before: float
    after: float


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitComputation:
    """Computes the limits of a target at scaled parameters; other processes can take it.

    Parameters
    ----------
    make
        Makes the model of some parameters.
    scale
        Scale of the parameters.
    target
        Families.
    """

    make: PaperModel
    scale: ParameterScale
    target: FamilyTarget

    def __call__(self, scaled: Values) -> FamilyLimits:
        """Limits at parameters, shape (p,) [steps]."""
        return self.target.compute_limits(self.make(self.scale.compose(scaled)))


@stage("fit of the rig's parameters", ignore=("make", "report", "map_over"))
def fit_parameters(
    inputs: ModelInputs,  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    scale: ParameterScale,
    target: FamilyTarget,
    most: int,
    make: PaperModel,
    report: Callable[[float, float], None] | None = None,
    map_over: MapOver = map,
) -> ParameterFit:
    """Tune some parameters to families.

    Parameters
    ----------
    inputs
        What the models depend on.
    scale
        What is tuned.
    target
        Families.
    most
        Evaluations at most [-].
    make
        Makes the model of some parameters.
    report
        Progress.
    map_over
        `map`, or one over processes.

    Raises
    ------
    InputError, NoSteadyState
        There is no model to start from.
    """
    compute = LimitComputation(make=make, scale=scale, target=target)
    start = np.zeros(len(scale.tuned))
    fit = fit_limits(compute, target, scale.prior, start, most=most, report=report, map_over=map_over)
    return ParameterFit(scale=scale, parameters=scale.compose(fit.values), before=fit.before, after=fit.after)
