r"""Distributions of uncertain parameters, each by its quantile function, which maps unit-cube draws to parameters.

With the standard normal quantile z(u):

.. math:: \text{normal: } m + s\, z, \qquad
          \text{lognormal: } \exp(\mu + \sigma z), \; \sigma^2 = \ln(1 + s^2 / m^2), \; \mu = \ln m - \sigma^2 / 2,
          \qquad \text{uniform: } a + (b - a)\, u .
"""

from dataclasses import dataclass
from math import exp, log, sqrt
from typing import ClassVar, Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Values = Float[NDArray[np.float64], " n"]


class Distribution(Protocol):
    """A distribution of one number."""

    name: ClassVar[str]

    @property
    def mean(self) -> float:
        """Its mean [unit of the parameter]."""

    @property
    def deviation(self) -> float:
        """Its standard deviation [unit of the parameter]."""

    def quantile(self, share: Values) -> Values:
        """Values below which shares in (0, 1) of all draws lie, shape (n,) [unit of the parameter]."""


@dataclass(frozen=True, kw_only=True)
class Normal:
    """A normal distribution by its mean and standard deviation."""

    name: ClassVar[str] = "normal"

    mean: float
    deviation: float

    def quantile(self, share: Values) -> Values:
        """See `Distribution`."""
        return np.asarray(self.mean + self.deviation * _standard_normal(share))


@dataclass(frozen=True, kw_only=True)
class Lognormal:
    """A lognormal distribution by the mean and standard deviation of its values, both positive."""

    name: ClassVar[str] = "lognormal"

    mean: float
    deviation: float

    def quantile(self, share: Values) -> Values:
        """See `Distribution`."""
        variance = log(1 + (self.deviation / self.mean) ** 2)
        median = self.mean * exp(-variance / 2)
        return np.asarray(median * np.exp(sqrt(variance) * _standard_normal(share)))


@dataclass(frozen=True, kw_only=True)
class Uniform:
    """A uniform distribution by its bounds."""

    name: ClassVar[str] = "uniform"

    lower: float
    upper: float

    @property
    def mean(self) -> float:
        """See `Distribution`."""
        return (self.lower + self.upper) / 2

    @property
    def deviation(self) -> float:
        """See `Distribution`."""
        return (self.upper - self.lower) / sqrt(12)

    def quantile(self, share: Values) -> Values:
        """See `Distribution`."""
        return np.asarray(self.lower + (self.upper - self.lower) * share)


def _standard_normal(share: Values) -> Values:
    from scipy.special import ndtri

    return np.asarray(ndtri(share))
