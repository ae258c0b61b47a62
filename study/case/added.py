"""Effects that were added to a case: the tables ``[[added]]``, with the name and the values of each effect."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from casefile.errors import CaseError
from casefile.quantity import DIMENSIONS, RATIO, Dimension, format_quantity, read_quantity
from casefile.table import Mistakes
from casefile.validation import did_you_mean
from correlation.model import Model
from correlation.unnamed_place import list_unnamed_places
from diagnosis.candidate.catalogue import Catalogue, list_effects
from diagnosis.candidate.effect import Effect, EffectError, EffectParameter
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration_parameter import CalibrationParameter
from study.case.tables import Case, StructureTable

#: Units for writing a value, by its SI unit: name and SI value of each.
WRITTEN = {
    "kg": (("kg", 1.0), ("g", 1e-3), ("mg", 1e-6), ("ug", 1e-9)),
    "m": (("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9)),
    "rad": (("deg", pi / 180),),
    "m/N": (("um/N", 1e-6), ("nm/N", 1e-9), ("pm/N", 1e-12)),
    "N/m": (("N/um", 1e6), ("N/mm", 1e3), ("N/m", 1.0)),
    "N/m^3": (("N/um^3", 1e18), ("N/mm^3", 1e9), ("N/m^3", 1.0)),
    "s": (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)),
}
#: Units of parameters whose bounds hold at any level of force.
LINEAR = ("kg", "kg m^2", "N/m", "N m", "m", "rad", "m/N", "-")
#: Digits of a value in a case file: far more than the accuracy of any fit.
DIGITS = 6

#: Largest number of effects that a message lists.
LISTED = 8


def list_case_effects(model: Model, files: Sequence[Path], names: Sequence[str] = (), **options: Any) -> Catalogue:
    """List all effects of a model, including those of the user's files and of installed packages.

    Parameters
    ----------
    model
        Model without added effects.
    files
        Python files with the user's effects.
    names
        Names of effects that may act at an unnamed place, such as "mass at dof 7".
    options
        Options of `diagnosis.candidate.catalogue.list_effects`.
    """
    return list_effects(with_places_of(model, names), extra=files, **options)


def with_places_of(model: Model, names: Sequence[str]) -> Model:
    """Add to a model the unnamed places at which effects of these names act."""
    folded = [_fold(name) for name in names]
    unnamed = list_unnamed_places(model).items() if names else ()
    asked = {place: row for place, row in unnamed if any(name.endswith(f" at {_fold(place)}") for name in folded)}
    return replace(model, places={**model.places, **asked}) if asked else model


def find_effect(result: Catalogue, name: str) -> Effect:
    """Find an effect by its name, in any case and spacing.

    Raises
    ------
    EffectError
        There is no such effect (the message has the nearest names), or it cannot be tested (with the reason).
    """
    wanted = _fold(name)
    for item in result.candidates:
        if item.name.casefold() == wanted:
            return item
    for left in result.untestable:
        if left.name.casefold() == wanted:
            raise EffectError(f'the effect "{left.name}" cannot act in this case: {left.reason}')
    near = _name_nearest(wanted, result.names)
    remedy = f"did you mean {near}?" if near else _name_effects(result.names)
    raise EffectError(f'there is no effect "{name}"; {remedy}')


def _fold(name: str) -> str:
    return " ".join(name.split()).casefold()


def _name_effects(names: Sequence[str]) -> str:
    if len(names) <= LISTED:
        return f"there are {', '.join(names) or 'none'}"
    return f"there are {len(names)}, such as {', '.join(names[:LISTED])}; a diagnosis lists all of them"


def read_added_effects(
    case: Case[StructureTable], model: Model, files: Sequence[Path], mistakes: Mistakes
) -> tuple[AddedEffect, ...]:
    """Read the effects of the tables ``[[added]]`` and their values; mistakes are recorded with their lines.

    Parameters
    ----------
    case
        Case with the tables.
    model
        Model without these effects.
    files
        Python files with the user's effects.
    mistakes
        Mistakes of the case so far; new ones are added.
    """
    if not case.added:
        return ()
    known: Catalogue | None = None
    with mistakes.at("effects"):
        known = list_case_effects(model, files, [table.effect for table in case.added])
    if known is None:
        raise CaseError(mistakes.problems)
    result: list[AddedEffect] = []
    for number, table in enumerate(case.added):
        with mistakes.at("added", number):
            effect = find_effect(known, table.effect)
            if effect.name in [item.effect.name for item in result]:
                raise EffectError(f'"{effect.name}" is added twice: keep one table')
            result.append(AddedEffect(effect=effect, values=_read_values(table.values, effect, case, number)))
    return tuple(result)


def apply_all(
    model: Model, known: Sequence[CalibrationParameter], calibrated: Mapping[str, float], added: Sequence[AddedEffect]
) -> Model:
    """Apply calibrated factors to a model, and then the added effects."""
    for factor in known:
        if factor.name in calibrated:
            model = factor.apply(model, [calibrated[factor.name]])
    for item in added:
        model = item.effect.apply(model, [float(value) for value in item.values])
    return model


def apply_by_name(
    finer: Model,
    files: Sequence[Path],
    known: Sequence[CalibrationParameter],
    calibrated: Mapping[str, float],
    added: Sequence[AddedEffect],
) -> Model:
    """Apply calibrated factors and added effects to a model of a finer mesh, on which effects have other rows.

    Raises
    ------
    EffectError
        The finer model does not have an effect of this name.
    """
    if not added:
        return apply_all(finer, known, calibrated, ())
    result = list_case_effects(finer, files)
    own = [AddedEffect(effect=result.alike(item.effect), values=item.values) for item in added]
    return apply_all(finer, known, calibrated, own)


def make_parameter_key(parameter: EffectParameter) -> str:
    """Key of a parameter in a table of a case file."""
    return re.sub(r"[^A-Za-z0-9]+", "_", parameter.name).strip("_") or "value"


def format_parameter(value: float, parameter: EffectParameter, digits: int = DIGITS) -> str:
    """Format a value for a case file, such as "93 mg"; a ratio has no unit."""
    if parameter.unit in {"-", ""}:
        return f"{value:.{digits}g}"
    units = WRITTEN.get(parameter.unit, ())
    unit = next((name for name, size in units if abs(value) >= size), units[-1][0] if units else parameter.unit)
    return format_quantity(value, unit, digits) if value and units else f"{value:.{digits}g} {unit}"


def read_parameter(text: object, parameter: EffectParameter) -> float:
    """Read the SI value of a parameter from a case file or the command line.

    Raises
    ------
    EffectError
        The text is not a number with a suitable unit, or the value is out of bounds.
    """
    try:
        value = read_quantity(text, _find_dimension(parameter))
    except ValueError as error:
        raise EffectError(str(error)) from None
    if parameter.unit in LINEAR and not parameter.lower <= value <= parameter.upper:
        lower, upper = (format_parameter(bound, parameter, 3) for bound in (parameter.lower, parameter.upper))
        raise EffectError(f"is out of bounds: give a value from {lower} to {upper}")
    return value


def _read_values(
    given: Mapping[str, Any], effect: Effect, case: Case[StructureTable], number: int
) -> NDArray[np.float64]:
    keys = {make_parameter_key(parameter): parameter for parameter in effect.parameters}
    for key in given:
        if key not in keys:
            hint = did_you_mean(key, list(keys)) or f"; it has {', '.join(keys)}"
            raise EffectError(f'"{key}" is not a parameter of "{effect.name}"{hint}')
    for key, parameter in keys.items():
        if key not in given:
            example = format_parameter(parameter.typical, parameter, 3)
            text = example if parameter.unit == "-" else f'"{example}"'
            raise EffectError(f'"{effect.name}" has no value: add {key} = {text}')
    values, source = [], case.source
    for key, parameter in keys.items():
        try:
            values.append(read_parameter(given[key], parameter))
        except EffectError as error:
            if source is None:
                raise
            raise CaseError([source.problem(("added", number, key), str(error))]) from None
    return np.array(values)


def _find_dimension(parameter: EffectParameter) -> Dimension:
    if parameter.unit in {"-", ""}:
        return RATIO
    known = next((item for item in DIMENSIONS if item.si == parameter.unit), None)
    example = format_parameter(parameter.typical, parameter, 3)
    return Dimension(known.name if known else f"a {parameter.name}", parameter.unit, example)


def _name_nearest(wanted: str, names: Sequence[str]) -> str:
    import difflib

    by_lower = {name.casefold(): name for name in names}
    close = difflib.get_close_matches(wanted, list(by_lower), 3, 0.5)
    return " or ".join(f'"{by_lower[name]}"' for name in close)
