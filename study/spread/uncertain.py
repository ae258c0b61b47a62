"""The uncertain parameters of a case, from `[[uncertain]]`, with a check of their distributions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.errors import CaseError
from casefile.table import at_key
from correlation.uncertainty.distribution import Distribution
from study.kind.registry import OpenCase
from study.sweep.parameter import CaseParameter, ParameterError, find_parameter, vary
from study.sweep.samples import Point

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Uncertain:
    """Uncertain parameters with their distributions.

    Parameters
    ----------
    parameters
        Parameters, at least one.
    distributions
        Distribution of each parameter, in its unit.
    """

    parameters: tuple[CaseParameter, ...]
    distributions: tuple[Distribution, ...]

    @property
    def mean(self) -> Float[Real, " d"]:
        """Mean of each parameter, shape (d,)."""
        return np.array([item.mean for item in self.distributions])

    @property
    def deviation(self) -> Float[Real, " d"]:
        """Standard deviation of each parameter, shape (d,)."""
        return np.array([item.deviation for item in self.distributions])

    def at(self, values: Sequence[float]) -> Point:
        """Return the entries of the case file for values of all parameters."""
        return {item: item.written(float(value)) for item, value in zip(self.parameters, values, strict=True)}

    def draws(self, points: Float[Real, "n d"]) -> Float[Real, "n d"]:
        """Convert points of the unit cube to values of the parameters, shape (n, d)."""
        return np.column_stack([item.quantile(points[:, number]) for number, item in enumerate(self.distributions)])


def read_uncertain(opened: OpenCase) -> Uncertain:
    """Read the uncertain parameters of a case.

    Raises
    ------
    CaseError
        There are no uncertain parameters, or one is not in the case, is named twice, or has an invalid mean.
    """
    if not opened.case.uncertain:
        raise opened.lacks(
            "uncertain",
            "there is no [[uncertain]], which defines the uncertain parameters: add one, with parameter, "
            'distribution and mean, e.g. parameter = "mu", distribution = "normal", mean = 1, relative_sd = "10 %"',
        )
    parameters: list[CaseParameter] = []
    for number, table in enumerate(opened.case.uncertain):
        with at_key(opened.case, "uncertain", number, "parameter"):
            parameter = find_parameter(opened, table.parameter, table.unit)
            if parameter.path in [item.path for item in parameters]:
                raise ParameterError("this parameter is named twice: keep one table")
        parameters.append(parameter)
    distributions = tuple(table.make() for table in opened.case.uncertain)
    result = Uncertain(parameters=tuple(parameters), distributions=distributions)
    check_draws(opened, result, result.mean[None])
    return result


def check_draws(opened: OpenCase, uncertain: Uncertain, draws: Float[Real, "n d"]) -> None:
    """Refuse draws with values that are invalid for the case; the smallest and largest of each parameter are checked.

    Raises
    ------
    CaseError
        A value is invalid; the first one is reported at its distribution.
    """
    for number, parameter in enumerate(uncertain.parameters):
        for value in (draws[:, number].min(), draws[:, number].max()):
            try:
                vary(opened, {parameter: parameter.written(float(value))})
            except CaseError as error:
                problem = error.problems[0]
                distribution = opened.case.uncertain[number].distribution
                assert opened.case.source is not None
                text = (
                    f"{parameter.text(float(value))} of this {distribution} distribution is not a valid value of the "
                    f"case ({problem.text}): give bounds or a standard deviation with valid values"
                )
                raise CaseError([opened.case.source.problem(("uncertain", number, "distribution"), text)]) from None
