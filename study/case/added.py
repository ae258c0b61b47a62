"""Effects that were added to a case: named in it with their values, so that the case is complete by itself."""

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

#: Units that a value is written in, by its SI unit, with the SI value of one.
WRITTEN = {
    "kg": (("kg", 1.0), ("g", 1e-3), ("mg", 1e-6), ("ug", 1e-9)),
    "m": (("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9)),
    "rad": (("deg", pi / 180),),
    "m/N": (("um/N", 1e-6), ("nm/N", 1e-9), ("pm/N", 1e-12)),
    "N/m": (("N/um", 1e6), ("N/mm", 1e3), ("N/m", 1.0)),
    "N/m^3": (("N/um^3", 1e18), ("N/mm^3", 1e9), ("N/m^3", 1.0)),
    "s": (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)),
}
#: Units of effects whose bounds hold at any level of force.
LINEAR = ("kg", "kg m^2", "N/m", "N m", "m", "rad", "m/N", "-")
#: Digits of a value in a case file: far more than any fit knows.
DIGITS = 6

#: Largest number of effects that a message lists.
LISTED = 8


def list_case_effects(model: Model, files: Sequence[Path], names: Sequence[str] = (), **options: Any) -> Catalogue:
    """All effects of a model, its case's own and those of installed packages among them.

    Parameters
    ----------
    model
        Without the effects that were added.
    files
        With effects of one's own.
    names
        Names of effects, which may act where no place is, such as "mass at dof 7".
    options
        As for `diagnosis.candidate.catalogue.list_effects`.
    """
    return list_effects(with_places_of(model, names), extra=files, **options)


def with_places_of(model: Model, names: Sequence[str]) -> Model:
    """The model with the places that effects of these names act at, where it has none."""
    folded = [_fold(name) for name in names]
    unnamed = list_unnamed_places(model).items() if names else ()
    asked = {place: row for place, row in unnamed if any(name.endswith(f" at {_fold(place)}") for name in folded)}
    return replace(model, places={**model.places, **asked}) if asked else model


def find_effect(result: Catalogue, name: str) -> Effect:
    """An effect by its name; case and spaces at the ends do not matter.

    Raises
    ------
    EffectError
        There is none, with the nearest names; or it cannot be tested, with the reason.
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
    """Effects of a case's ``[[added]]`` tables with their values; mistakes are noted with their lines.

    Parameters
    ----------
    case
        Case, as it was read.
    model
        Without them.
    files
        With effects of one's own.
    mistakes
        Mistakes of the case so far.
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
    """The model with calibrated factors, and the added effects on top of them."""
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
    """Apply effects by name to another mesh of the structure, where they have other rows.

    Raises
    ------
    EffectError
        The finer model does not have such an effect.
    """
    if not added:
        return apply_all(finer, known, calibrated, ())
    result = list_case_effects(finer, files)
    own = [AddedEffect(effect=result.alike(item.effect), values=item.values) for item in added]
    return apply_all(finer, known, calibrated, own)


def make_parameter_key(parameter: EffectParameter) -> str:
    """Its key in a table of a case file."""
    return re.sub(r"[^A-Za-z0-9]+", "_", parameter.name).strip("_") or "value"


def format_parameter(value: float, parameter: EffectParameter, digits: int = DIGITS) -> str:
    """A value as a case file writes it: "93 mg"; a ratio as a bare number."""
    if parameter.unit in {"-", ""}:
        return f"{value:.{digits}g}"
    units = WRITTEN.get(parameter.unit, ())
    unit = next((name for name, size in units if abs(value) >= size), units[-1][0] if units else parameter.unit)
    return format_quantity(value, unit, digits) if value and units else f"{value:.{digits}g} {unit}"


def read_parameter(text: object, parameter: EffectParameter) -> float:
    """SI value of what stands in a case file or on the command line.

    Raises
    ------
    EffectError
        No number with a fitting unit.
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
