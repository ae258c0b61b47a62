"""The table ``[[uncertain]]``: an uncertain parameter of the case and its distribution."""

import math
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from casefile.number_with_unit import NumberWithUnit, split_quantity
from casefile.quantity import Ratio
from casefile.table import CaseModel
from correlation.uncertainty.distribution import Distribution, Lognormal, Normal, Uniform

#: Keys that each distribution accepts.
GIVEN_BY = {
    "normal": ("mean", "sd", "relative_sd"),
    "lognormal": ("mean", "sd", "relative_sd"),
    "uniform": ("from", "to", "mean", "sd", "relative_sd"),
}


def _deviation(value: object) -> NumberWithUnit:
    result = split_quantity(value)
    if not result.number > 0:
        raise ValueError("must be positive: it is a standard deviation; remove the table if the parameter is known")
    return result


Quantity = Annotated[NumberWithUnit, BeforeValidator(split_quantity)]
Deviation = Annotated[NumberWithUnit, BeforeValidator(_deviation)]


class UncertainTable(CaseModel):
    """An uncertain parameter, and its distribution by mean and standard deviation or by bounds."""

    parameter: Annotated[str, Field(min_length=1, examples=["mu"])]
    distribution: Annotated[Literal["normal", "lognormal", "uniform"], Field(examples=["normal"])]
    mean: Quantity | None = None
    sd: Deviation | None = None
    relative_sd: Annotated[Ratio, Field(gt=0)] | None = None
    lower: Annotated[Quantity | None, Field(alias="from")] = None
    upper: Annotated[Quantity | None, Field(alias="to")] = None

    @property
    def unit(self) -> str:
        """Unit of all numbers of the distribution."""
        given = self.mean if self.mean is not None else self.lower
        return "" if given is None else given.unit

    def make(self) -> Distribution:
        """Make the distribution, in `unit`."""
        if self.lower is not None and self.upper is not None:
            return Uniform(lower=self.lower.number, upper=self.upper.number_in(self.unit))
        assert self.mean is not None
        mean = self.mean.number
        deviation = abs(mean) * (self.relative_sd or 0.0) if self.sd is None else self.sd.number_in(self.unit)
        if self.distribution == "uniform":
            half = math.sqrt(3) * deviation
            return Uniform(lower=mean - half, upper=mean + half)
        kind = Normal if self.distribution == "normal" else Lognormal
        return kind(mean=mean, deviation=deviation)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        keys = {
            "mean": self.mean, "sd": self.sd, "relative_sd": self.relative_sd, "from": self.lower, "to": self.upper
        }  # fmt: skip
        given = [key for key, value in keys.items() if value is not None]
        what = f"a {self.distribution} distribution"
        for key in given:
            if key not in GIVEN_BY[self.distribution]:
                raise ValueError(f"{key} is not used for {what}: remove it, or take a uniform one")
        bounds = [key for key in given if key in {"from", "to"}]
        if bounds and len(given) > len(bounds):
            raise ValueError(f"{what} is given by from and to or by mean and sd: remove {bounds[0]} or the others")
        if len(bounds) == 1:
            raise ValueError(f"{what} has only one bound: add {'to' if bounds == ['from'] else 'from'}")
        if not bounds:
            self._check_moments(what)
        self._check_numbers(what)
        return self

    def _check_moments(self, what: str) -> None:
        if self.mean is None:
            bounds = ", or from and to" if self.distribution == "uniform" else ""
            raise ValueError(f'{what} needs a mean: add mean, e.g. mean = 1 or mean = "20 N"{bounds}')
        if (self.sd is None) == (self.relative_sd is None):
            raise ValueError(f"{what} needs a standard deviation: give either sd, in the unit of mean, or relative_sd")
        if self.relative_sd is not None and self.mean.number == 0:
            raise ValueError("relative_sd of a mean of 0 is 0: give sd instead")
        if self.distribution == "lognormal" and not self.mean.number > 0:
            raise ValueError(f"mean = {self.mean.number:g}: {what} has only positive values: take a normal one")

    def _check_numbers(self, what: str) -> None:
        made = self.make()
        if isinstance(made, Uniform) and not made.lower < made.upper:
            raise ValueError(f"from = {made.lower:g} is not below to = {made.upper:g}: {what} lies between them")
