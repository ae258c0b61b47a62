"""The JSON document of a diagnosis; strengths in SI units."""

from typing import Any

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.fit.problem import Refit
from diagnosis.localisation import UnknownForcePlace
from diagnosis.resonator import Resonator
from study.diagnose.doubt import list_doubts, list_notes
from study.diagnose.report import format_headline
from study.diagnose.round import Round, summarise_errors
from study.diagnose.stages import list_stages
from study.diagnose.table import (
    Row,
    format_strength,
    list_factors,
    list_frequency_shifts,
    list_rows,
    list_sensor_gains,
    list_strengths,
)


def make_document(result: Round) -> dict[str, Any]:
    """The report for ``--json`` and ``diagnosis.json``; strengths in SI units."""
    diagnosis, further = result.diagnosis, result.diagnosis.verdict.further
    further_alternatives = diagnosis.verdict.further_alternatives
    return {
        "title": result.setup.title,
        "campaign": result.campaign.title,
        "finding": diagnosis.verdict.finding.value,
        "verdict": format_headline(result),
        "doubts": list_doubts(result),
        "notes": list_notes(result),
        "suspicions": [str(entry) for entry in result.suspicions],
        "model_error": vars(diagnosis.verdict.model_error_size),
        "effects": [item.effect.name for item in diagnosis.verdict.effects if item.effect is not None],
        "probabilities": [*diagnosis.verdict.probabilities],
        "alike": [*diagnosis.verdict.alike],
        "laws": [_document_law(law) for law in diagnosis.verdict.laws],
        "further": None if further is None else _document_effect(further),
        "further_alternatives": [_document_effect(item) for item in further_alternatives],
        "threshold": diagnosis.verdict.threshold,
        "thresholds": vars(diagnosis.thresholds),
        "errors": {**_document_case_errors(result), "before": summarise_errors(diagnosis.baseline).document},
        "named": [_document_effect(item) for item in diagnosis.verdict.effects],
        "calibrated": {
            name: {**_estimate(factor, deviation, "factor"), "in_case": result.setup.calibrated.get(name)}
            for name, (factor, deviation) in list_factors(result.setup, diagnosis.baseline).items()
        },
        "frequency_shifts": list_frequency_shifts(result.setup, diagnosis.baseline),
        "gains": {
            name: _estimate(*numbers, "gain")
            for name, numbers in list_sensor_gains(result.setup, diagnosis.baseline).items()
        },
        "added": _document_added(result),
        "candidates": [_document_row(row) for row in list_rows(result)],
        "places": [_document_place(entry) for entry in diagnosis.places if isinstance(entry, UnknownForcePlace)],
        "resonators": [_document_resonator(entry) for entry in diagnosis.places if isinstance(entry, Resonator)],
        "missing_law": None if result.law is None else result.law.document,
        "next_test": result.next_step.document,
        "untestable": [{"effect": item.name, "reason": item.reason} for item in diagnosis.catalogue.untestable],
    }


def _document_added(result: Round) -> list[dict[str, Any]]:
    """Effects that were added before, with their strengths in the fit and in the case."""
    fitted = list_strengths(result.setup, result.diagnosis.baseline)
    return [
        {
            "effect": effect.name,
            **_estimate(strength, deviation),
            "unit": effect.parameters[0].unit,
            "in_case": float(was.values[0]),
        }
        for (effect, strength, deviation), was in zip(fitted, result.setup.added, strict=True)
    ]


def _document_place(place: UnknownForcePlace) -> dict[str, Any]:
    """A place where an unknown force would explain the residual."""
    return {
        "place": place.name,
        "configuration": place.configuration,
        "gain": place.gain,
        "exponent": place.exponent,
        "exponent_deviation": place.exponent_deviation,
        "phase_deg": place.phase,
        "levels_n": place.level,
        f"amplitude_{place.units.motion}": place.amplitude,
        "stiffness_real": place.stiffness.real,
        "stiffness_imag": place.stiffness.imag,
        "stiffness_deviation": place.deviation,
    }


def _document_effect(item: Refit) -> dict[str, Any]:
    """An effect with its strength, and the decreases of -2 ln p by it."""
    assert item.effect is not None
    return {
        "effect": item.name,
        **_estimate(item.strength, item.deviation),
        "unit": item.effect.parameters[0].unit,
        "gain": item.gain,
        "held_out_gain": item.held_out_gain,
    }


def _document_case_errors(result: Round) -> dict[str, Any]:
    """Errors of the nominal model, without calibrated values and added effects, and of the whole case."""
    named = {"nominal": "drawn", "as in the case": "in_case"}
    return {
        named[item.name]: summarise_errors(item.refit).document for item in list_stages(result) if item.name in named
    }


def _document_resonator(resonator: Resonator) -> dict[str, Any]:
    return {
        "place": resonator.name,
        "configuration": resonator.configuration,
        "gain": resonator.gain,
        "frequency_hz": resonator.frequency,
        "damping_ratio": resonator.damping,
        "mass": resonator.mass,
        "deviation": resonator.deviation,
        "unit": resonator.unit,
    }


def _document_law(law: FittedLaw) -> dict[str, Any]:
    """A law that replaces that of an effect; its gains are relative to the effect."""
    assert law.refit.effect is not None
    parameters, fit = law.refit.effect.parameters, law.refit.fit
    numbers = zip(parameters, fit.values[-len(parameters) :], fit.deviation[-len(parameters) :], strict=True)
    return {
        "law": law.refit.effect.kind,
        "in_words": law.words,
        "gain": law.gain,
        "held_out_gain": law.held_out_gain,
        "held_out_error": law.refit.held_out_error,
        "values": {
            parameter.name: {**_estimate(float(value), float(deviation), "value"), "unit": parameter.unit}
            for parameter, value, deviation in numbers
        },
    }


def _estimate(value: float, deviation: float, name: str = "strength") -> dict[str, Any]:
    """A fitted number with its standard deviation and its 95 % interval."""
    half = TWO_SIDED_95 * deviation
    return {name: value, "deviation": deviation, "interval_95": [value - half, value + half]}


def _document_row(row: Row) -> dict[str, Any]:
    return {
        "effect": row.effect.name,
        "kind": row.effect.kind,
        "named": row.named,
        "expected_gain": row.expected,
        "gain": row.gain,
        **_estimate(row.strength, row.deviation),
        "unit": row.parameter.unit,
        "in_words": row.in_words,
        "errors": None if row.errors is None else row.errors.document,
        "cosine_to_best": row.cosine,
        "smallest_detectable": row.detectable,
        "smallest_detectable_in_words": format_strength(row.detectable, row.parameter),
    }
