"""Alternative laws for the force of an effect: another power, a clearance, an even power.

They are not effects of the catalogue: they show whether an effect stands in for another force law.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import Effect, EffectParameter
from geometry.plain_number import format_number
from reduction.joint_law.elastic_stop import ElasticStop
from reduction.joint_law.polynomial_spring import PolynomialSpring
from reduction.joint_law.power_spring import PowerSpring

Row = Float[NDArray[np.float64], " r"]

#: Exponents closer than this count as equal, since real springs follow a power only approximately [-].
EXPONENT_TOLERANCE = 0.5
#: Largest exponent that is tried; a stop that is just reached has such a large exponent [-].
MOST_STEEP = 11.0
#: Range of a stiffness about its start value, and largest clearance over the largest displacement [-].
RANGE, BEYOND = 1e4, 1.5
#: Start value g of a clearance over the largest displacement, and share of its stiffness that a spring beyond it on
#: both sides has for the fundamental: 1 - 2/pi (asin g + g sqrt(1 - g^2)) [-].
CLEARANCE = 0.5
REACHED = 1 - 2 / np.pi * (np.arcsin(CLEARANCE) + CLEARANCE * np.sqrt(1 - CLEARANCE**2))


class ForceLaw(Effect, Protocol):
    """A law as an effect, with start values of a fit and a description of its result."""

    @property
    def start(self) -> tuple[float, ...]:
        """Start values of a fit."""
        ...

    @property
    def is_expected(self) -> bool:
        """Whether it is always tried; otherwise only if the effect explains little."""
        ...

    def is_distinct(self, values: Sequence[float], deviations: Sequence[float]) -> bool:
        """Whether the law differs from that of the replaced effect, by its 95 % intervals."""
        ...

    def describe(self, values: Sequence[float], deviations: Sequence[float]) -> str:
        """The law with its fitted values in words."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class SpringLaw:
    """A law along a row, shape (r,) [-], its parameters, and the start values of a fit."""

    name: str
    row: Row
    parameters: tuple[EffectParameter, ...]
    start: tuple[float, ...]
    is_expected: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerLaw(SpringLaw):
    """f = k u abs(u / r)^(p - 1); k and p are fitted."""

    reference: float
    """r [m]."""
    law: float
    """Power of the replaced effect [-]."""
    kind: str = "power law"
    physics: str = "The force grows with another power of the displacement."
    signature: str = "The resonance frequency shifts with another power of the amplitude."

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """One joint more."""
        stiffness, exponent = values
        spring = PowerSpring(
            name=self.name, direction=self.row, stiffness=stiffness, reference=self.reference, exponent=exponent
        )
        return model.with_system(joints=[*model.system.joints, spring])

    def is_distinct(self, values: Sequence[float], deviations: Sequence[float]) -> bool:
        """Whether the power differs from that of the replaced effect and from 1."""
        apart = min(abs(values[1] - self.law), abs(values[1] - 1.0))
        return apart > EXPONENT_TOLERANCE and apart > TWO_SIDED_95 * deviations[1]

    def describe(self, values: Sequence[float], deviations: Sequence[float]) -> str:
        """The power with its 95 % interval."""
        half = TWO_SIDED_95 * deviations[1]
        return f"a force that grows with the displacement to the power {values[1]:.1f} +- {half:.1g}"


@dataclass(frozen=True, kw_only=True, eq=False)
class ClearanceLaw(SpringLaw):
    """A spring beyond a clearance; its stiffness and the clearance are fitted."""

    sides: tuple[float, ...]
    """Directions of the row in which it acts, 1 and -1 [-]."""
    kind: str = "clearance"
    physics: str = "A stop or backlash: a spring acts only beyond a clearance."
    signature: str = "The resonance frequency is constant until the motion exceeds the clearance, and then rises."

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """A joint more for each side."""
        stiffness, gap = values
        stops = [
            ElasticStop(name=f"{self.name} {number}", direction=side * self.row, stiffness=stiffness, gap=gap)
            for number, side in enumerate(self.sides)
        ]
        return model.with_system(joints=[*model.system.joints, *stops])

    def is_distinct(self, values: Sequence[float], deviations: Sequence[float]) -> bool:
        """Whether the clearance is significant."""
        return values[1] > TWO_SIDED_95 * deviations[1]

    def describe(self, values: Sequence[float], deviations: Sequence[float]) -> str:
        """Stiffness and clearance with their 95 % intervals."""
        stiffness, gap = self.parameters
        # Clearances are some micrometres.
        scale, unit = (1e6, "um") if gap.unit == "m" else (1.0, gap.unit)
        spring = _format_value(values[0], deviations[0], stiffness.unit)
        clearance = _format_value(scale * values[1], scale * deviations[1], unit)
        where = "on either side" if len(self.sides) == 2 else "on one side"
        return f"a spring of {spring} beyond a clearance of {clearance} {where}"


@dataclass(frozen=True, kw_only=True, eq=False)
class EvenLaw(SpringLaw):
    """f = k u^2; k is fitted."""

    kind: str = "even law"
    physics: str = "A spring that is stiffer on one side, as in a bent or preloaded structure."
    signature: str = (
        "The resonance frequency falls with the square of the amplitude; a mean and a second harmonic appear."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """One joint more."""
        spring = PolynomialSpring(name=self.name, direction=self.row, quadratic=values[0])
        return model.with_system(joints=[*model.system.joints, spring])

    def is_distinct(self, values: Sequence[float], deviations: Sequence[float]) -> bool:
        """Always: no effect of the catalogue is even."""
        del values, deviations
        return True

    def describe(self, values: Sequence[float], deviations: Sequence[float]) -> str:
        """The factor with its 95 % interval."""
        factor = _format_value(values[0], deviations[0], self.parameters[0].unit)
        return f"a force proportional to the square of the displacement, {factor}"


def _format_value(value: float, deviation: float, unit: str) -> str:
    """A value with its 95 % interval."""
    return f"{format_number(value, 3)} +- {format_number(TWO_SIDED_95 * deviation, 2)} {unit}"


def make_power_law(name: str, row: Row, secant: float, largest: float, law: float, *, rotational: bool) -> PowerLaw:
    """A power law that starts with the law of an effect, given by its secant stiffness at the largest displacement."""
    reach = RANGE * abs(secant)
    stiffness = EffectParameter(
        name="stiffness", unit="N m" if rotational else "N/m", lower=-reach, upper=reach, typical=secant
    )
    exponent = EffectParameter(name="exponent", unit="-", lower=1.0, upper=MOST_STEEP, typical=law + 1.0, vanishes=law)
    return PowerLaw(
        name=f"power law for {name}", row=row, reference=largest, law=law, parameters=(stiffness, exponent),
        start=(secant, law),
    )  # fmt: skip


def make_clearance_laws(name: str, row: Row, secant: float, largest: float, *, rotational: bool) -> list[ClearanceLaw]:
    """Springs beyond a clearance on both sides and on either one, with a given stiffness at the largest displacement.

    Parameters
    ----------
    name
        Name of the replaced effect.
    row
        Row of the displacement, shape (r,) [-].
    secant
        Stiffness of the fundamental at the largest displacement, positive [N/m].
    largest
        Largest displacement [m].
    rotational
        Whether the displacement is an angle.
    """
    result = []
    for sides in ((1.0, -1.0), (1.0,), (-1.0,)):
        stiff = 2 * secant / (len(sides) * REACHED)
        stiffness = EffectParameter(
            name="stiffness", unit="N m" if rotational else "N/m", lower=stiff / RANGE, upper=RANGE * stiff,
            typical=stiff, vanishes=stiff / RANGE,
        )  # fmt: skip
        gap = EffectParameter(
            name="clearance", unit="rad" if rotational else "m", lower=0.0, upper=BEYOND * largest,
            typical=CLEARANCE * largest,
        )  # fmt: skip
        label = " and ".join(f"{side:+.0f}" for side in sides)
        result.append(
            ClearanceLaw(
                name=f"clearance {label} for {name}", row=row, sides=sides, parameters=(stiffness, gap),
                start=(stiff, CLEARANCE * largest),
            )
        )  # fmt: skip
    return result


def make_even_laws(name: str, row: Row, cubic: float, compliance: float, *, rotational: bool) -> list[EvenLaw]:
    r"""Even laws of either sign that change the fundamental as much as a cubic spring k_3.

    With a cosine of amplitude a, k u^2 causes a mean and a second harmonic of -k a^2 / 2 times their receptances
    alpha_0 and alpha_2. Their products with the cosine give a fundamental force of -k^2 a^3 (alpha_0 + alpha_2 / 2).
    Near the resonance of one mode alpha_2 = -alpha_0 / 3, so that 3/4 k_3 = -5/6 k^2 alpha_0.

    Parameters
    ----------
    name
        Name of the replaced effect.
    row
        Row of the displacement, shape (r,) [-].
    cubic
        k_3 [N/m^3].
    compliance
        alpha_0, of the row [m/N].
    rotational
        Whether the displacement is an angle.
    """
    size = float(np.sqrt(0.9 * abs(cubic) / compliance))
    unit, reach = "N m" if rotational else "N/m^2", RANGE * size
    return [
        EvenLaw(
            name=f"even law {sign:+.0f} for {name}", row=row, start=(sign * size,), is_expected=cubic < 0,
            parameters=(EffectParameter(name="factor", unit=unit, lower=-reach, upper=reach, typical=sign * size),),
        )
        for sign in (1.0, -1.0)
    ]  # fmt: skip
