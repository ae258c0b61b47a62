"""Calibration parameters kt, kn, mu, zeta, E and bearing, which are fitted together with every effect.

They are factors on the values of the model, common to all contacts or parts, with a prior and with the same `apply` as
an effect. They are applied before the effects, so that zeta does not scale an added dashpot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from correlation.model import LoadCell, Model
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from diagnosis.candidate.effect import Effect, EffectError, EffectParameter
from diagnosis.fit.contact_position import find_contact_position_bounds, with_contact_position

#: Relative standard deviation of each prior [-]; bearing is calibrated only if a value is given.
DEVIATION = {"kt": 0.10, "kn": 0.10, "mu": 0.10, "zeta": 0.20, "E": 0.01, "bearing": 0.0}
#: Field of `FrictionContact` that each scales.
CONTACT = {"kt": "tangential_stiffness", "kn": "normal_stiffness", "mu": "friction_coefficient"}
WHAT = {
    "kt": "Tangential stiffness of all contacts of all lines.",
    "kn": "Normal stiffness of all contacts of all lines.",
    "mu": "Friction coefficient of all contacts of all lines.",
    "zeta": "Viscous damping of the structure.",
    "E": "Young's modulus of all parts.",
    "bearing": "Distance of all contacts from the middle of their lines.",
}
#: Limit of a fit in standard deviations of the prior: one in two million draws is further from the centre.
MAX_PRIOR_RESIDUAL = 5.0
#: Distance of a bound from 1, over the deviation of the prior, below which there is nothing to calibrate [-].
LEAST_REACH = 0.01
#: Bounds of the factor: contacts and damping are known to an order of magnitude, a modulus far better.
BOUNDS = {
    "kt": (0.1, 10.0),
    "kn": (0.1, 10.0),
    "mu": (0.1, 10.0),
    "zeta": (0.05, 20.0),
    "E": (0.7, 1.4),
    "bearing": (0.7, 1.3),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibrationParameter:
    """A factor on a property of all contacts, on the damping or on the modulus of all parts.

    Parameters
    ----------
    name
        "kt", "kn", "mu", "zeta", "E" or "bearing".
    deviation
        Standard deviation of its prior around 1 [-].
    parameters
        The factor.
    """

    name: str
    physics: str
    deviation: float
    parameters: tuple[EffectParameter, ...]
    kind: str = "calibration"
    signature: str = "It is calibrated together with every effect, and without effects."

    #: Whether a case can contain a value of it.
    is_of_case: ClassVar[bool] = True

    @property
    def stated_deviation(self) -> float:
        """Standard deviation stated in the case; the prior of a fit may be wider [-]."""
        return self.deviation

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the factor; 1 changes nothing, nor does a contact factor on a test without contacts."""
        (factor,) = values
        system = model.system
        if self.name in CONTACT:
            return scale_contacts(model, dict.fromkeys(model.lines, factor), CONTACT[self.name])
        if self.name == "zeta":
            return model.with_system(damping=factor * system.damping)
        if self.name == "bearing":
            return with_contact_position(model, factor)
        whole = np.sum([part.stiffness for part in model.parts if part.name not in model.elastic_bodies], axis=0)
        loss = system.structural_damping
        # The row of a load cell is a stiffness too.
        sensors = [replace(one, row=factor * one.row) if isinstance(one, LoadCell) else one for one in model.sensors]
        changed = replace(model, sensors=tuple(sensors)).with_material(
            system.mass, system.stiffness + (factor - 1) * whole
        )
        if loss is not None:
            # Young's modulus is complex where the material has a loss factor.
            changed = changed.with_system(structural_damping=factor * loss)
        # The springs of a clamp do not belong to the material of a part.
        for name, body in model.elastic_bodies.items():
            changed = changed.with_elastic_body(name, body.scale_stiffness(factor))
        return changed


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedEffect(CalibrationParameter):
    """An effect with one parameter, its prior centred at the neutral value, within its bounds: see `from_effect`.

    Parameters
    ----------
    effect
        Effect, such as the shift of a dead weight.
    """

    effect: Effect

    #: A case lists it among its added effects.
    is_of_case = False

    @classmethod
    def from_effect(cls, effect: Effect, deviation: float) -> "CalibratedEffect":
        """The strength of an effect as a calibration parameter.

        Parameters
        ----------
        effect
            Effect.
        deviation
            Standard deviation of the prior of its strength [its unit].

        Raises
        ------
        EffectError
            An effect of several parameters, or a deviation that is not positive.
        """
        if len(effect.parameters) != 1:
            names = ", ".join(item.name for item in effect.parameters)
            raise EffectError(f'"{effect.name}" has the parameters {names}: one alone can be calibrated')
        if not (np.isfinite(deviation) and deviation > 0):
            raise EffectError(
                f'the deviation of "{effect.name}" is {deviation:g}: give a standard deviation above zero'
            )
        (own,) = effect.parameters
        furthest = MAX_PRIOR_RESIDUAL * deviation
        lower, upper = max(own.lower, own.vanishes - furthest), min(own.upper, own.vanishes + furthest)
        typical = min(own.vanishes + deviation, upper) if upper > own.vanishes else lower
        return cls(
            name=effect.name, physics=effect.physics, signature=effect.signature, deviation=deviation, effect=effect,
            parameters=(replace(own, lower=lower, upper=upper, typical=typical),),
        )  # fmt: skip

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The model with the effect."""
        return self.effect.apply(model, values)


def list_calibration_parameters(
    model: Model, *, deviation: Mapping[str, float] | None = None, finer: Sequence[Model] = ()
) -> tuple[CalibrationParameter, ...]:
    """Calibration parameters of a model.

    Parameters
    ----------
    model
        Model; without contact lines it has no kt, kn and mu, without friction no mu, without damping no zeta.
    deviation
        Other standard deviations of the priors, by name, relative to the model's values [-]; 0 leaves a parameter out.
    finer
        Finer models that the factors are applied to as well, which limit their bounds.

    Raises
    ------
    EffectError
        An unknown name, or a deviation that is negative or not finite.
    """
    given = dict(deviation or {})
    for name, value in given.items():
        if name not in DEVIATION:
            raise EffectError(f'"{name}" is not a calibration parameter: there are {", ".join(DEVIATION)}')
        if not (np.isfinite(value) and value >= 0):
            raise EffectError(f"the deviation of {name} is {value:g}: give a relative standard deviation, such as 0.1")
    return tuple(
        CalibrationParameter(
            name=name,
            physics=WHAT[name],
            deviation=float(value),
            parameters=(_make_bounded_factor([model, *finer], name, float(value)),),
        )
        for name, value in (DEVIATION | given).items()
        if value and _has(model, name)
    )


def _make_bounded_factor(models: Sequence[Model], name: str, deviation: float) -> EffectParameter:
    factor = make_factor(name, *BOUNDS[name], deviation)
    lower, upper = factor.lower, factor.upper
    for item in models if name == "bearing" else ():
        lower, upper = find_contact_position_bounds(item, lower, upper)
    return make_factor(name, lower, upper, deviation)


def make_factor(name: str, lower: float, upper: float, deviation: float) -> EffectParameter:
    """A factor with a prior about 1, within bounds and within `MAX_PRIOR_RESIDUAL` standard deviations.

    Parameters
    ----------
    name
        Name of the scaled quantity.
    lower, upper
        Bounds, which include 1 [-].
    deviation
        Standard deviation of its prior [-].

    Raises
    ------
    EffectError
        Bounds that leave nothing to calibrate.
    """
    lower, upper = max(lower, 1 - MAX_PRIOR_RESIDUAL * deviation), min(upper, 1 + MAX_PRIOR_RESIDUAL * deviation)
    # A law may admit no value beyond 1 on one side: the search starts on the wider side.
    typical = max(min(1 + deviation, upper), max(1 - deviation, lower), key=lambda value: abs(value - 1))
    if abs(typical - 1) < LEAST_REACH * deviation:
        raise EffectError(f'a factor on "{name}" may only be {lower:.9g} to {upper:.9g}: do not calibrate it')
    return EffectParameter(name="factor", unit="-", lower=lower, upper=upper, typical=typical, vanishes=1.0)


def _has(model: Model, name: str) -> bool:
    if name in CONTACT:
        members = [contact for line in model.lines for contact in find_contacts(model, line)]
        return any(getattr(contact, CONTACT[name]) for contact in members)
    if name == "zeta":
        return bool(model.system.damping.any())
    if name == "bearing":
        return any(len(names) > 2 for names in model.lines.values())
    return any(part.stiffness.any() for part in model.parts)
