"""Page and figures of a diagnosis; the page is a self-contained HTML file with plotly.js, which loads nothing."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.decision.verdict import Finding
from diagnosis.localisation import UnknownForcePlace
from diagnosis.resonator import Resonator
from figure.candidates import CandidateBar, Candidates
from figure.misfit_map import COLOUR_STEPS, COLOURS
from figure.registry import pictures
from figure.waterfall import Waterfall
from geometry.plain_number import percent
from study.compare.report import join_titles
from study.diagnose.advice import choose_advice, choose_tag
from study.diagnose.curves import make_curves, make_maps
from study.diagnose.doubt import list_doubts, list_notes
from study.diagnose.history import History
from study.diagnose.law_drawing import make_law_drawing
from study.diagnose.next_test_drawing import make_next_tests
from study.diagnose.report import LAW_FILE, describe_threshold, format_headline
from study.diagnose.resonance import describe_level_dependence, draw_resonances
from study.diagnose.round import Round, summarise_errors
from study.diagnose.stages import FitStage, describe_fall, list_stages, make_waterfall
from study.diagnose.table import MARKED_ALIKE, format_digits, format_interval, list_factors, list_rows, list_strengths
from study.page.html import embed, render_page, typeset_text

TEMPLATE = Path(__file__).with_name("page.html.j2")
SCRIPT = Path(__file__).with_name("page.js")
#: Number of candidates that the page shows initially, and of those in the figure.
SHOWN, MOST = 8, 16
#: Pictures embedded in the page, by the ends of their names.
EMBEDDED = ("missing_law", "next_test")
#: Tolerances for naming an exponent and a phase [-, deg].
NEAR_EXPONENT, NEAR_PHASE = 0.35, 25.0


def make_files(result: Round, history: History, case: Path) -> dict[str, bytes]:
    """Files by their names: the page and the figures of a round.

    Parameters
    ----------
    result
        The last round.
    history
        History of the case.
    case
        Case file.
    """
    steps, listed = make_waterfall(result, history), list_rows(result)[:MOST]
    title = join_titles(result.setup.title, result.campaign.title)
    stem = f"{case.stem}_diagnosis"
    files: dict[str, bytes] = {}
    drawn: dict[str, object] = {f"{stem}_waterfall": Waterfall(steps=steps, title=title, subtitle=describe_fall(steps))}
    if listed:
        drawn[f"{stem}_candidates"] = Candidates(
            candidates=[
                CandidateBar(
                    name=row.effect.name,
                    gain=row.fall,
                    is_fitted=row.gain is not None,
                    is_named=row.named,
                    held_out=None if row.errors is None else row.errors.held_out,
                    strength=typeset_text(row.in_words),
                )
                for row in listed
            ],
            threshold=result.diagnosis.thresholds.gain,
            before=result.diagnosis.baseline.held_out_error,
            title=title,
            subtitle="candidates, those named and fitted first; dashed: detection threshold "
            f"{result.diagnosis.thresholds.gain:.3g}",
        )
    if result.law is not None:
        drawn[f"{stem}_missing_law"] = make_law_drawing(result.law, title)
        files[LAW_FILE] = result.law.effect_file.encode()
    if result.next_step.advice is not None:
        units = {item.name: item.unit for item in result.campaign.sensors}
        drawn[f"{stem}_next_test"] = make_next_tests(result.next_step, title, units)
    made = pictures(drawn)
    shown = {name: embed(made[f"{stem}_{name}"]) for name in EMBEDDED if f"{stem}_{name}" in made}
    files[f"{stem}.html"] = make_page(result, history, shown).encode()
    return files | {f"{name}.png": picture for name, picture in made.items()}


def make_page(result: Round, history: History, shown_pictures: Mapping[str, str]) -> str:
    """HTML of a round.

    Parameters
    ----------
    result
        The round.
    history
        History of the case.
    shown_pictures
        Pictures of `EMBEDDED` as data addresses, by name.
    """
    listed = list_stages(result)
    before, after = (listed[-2], listed[-1])
    falling = make_waterfall(result, history)
    # More than three kinds of lines are hard to distinguish.
    shown = list(dict.fromkeys([listed[0], before, after]))
    backbones = draw_resonances(result, shown)
    drawn = {
        "waterfall": [vars(step) for step in falling],
        "curves": make_curves(result, shown),
        "backbones": backbones,
        "maps": make_maps(result, [before, after]),
        "steps": list(COLOUR_STEPS),
        "mapColours": list(COLOURS),
    }
    return render_page(
        TEMPLATE,
        SCRIPT,
        drawn,
        {"digits": format_digits, "percent": percent, "factor": _format_factor, "place": _place},
        title=result.setup.title,
        campaign=result.campaign.title,
        finding=result.diagnosis.verdict.finding.value,
        headline=format_headline(result),
        doubts=list_doubts(result),
        notes=list_notes(result),
        advice=choose_advice(result),
        tag=choose_tag(result),
        wrong=bool(result.wrong),
        threshold=describe_threshold(result),
        n_backbone=len(backbones),
        resonances=[*describe_level_dependence(result)],
        cards=_make_cards(listed),
        chain=" → ".join(stage.name for stage in listed),
        falls=describe_fall(falling),
        candidates=list_rows(result),
        same=MARKED_ALIKE,
        n_shown=SHOWN,
        held_out_before=percent(result.diagnosis.baseline.held_out_error, 3),
        is_nothing=result.diagnosis.verdict.finding is Finding.NOTHING,
        places=[entry for entry in result.diagnosis.places if isinstance(entry, UnknownForcePlace)],
        swings=isinstance(result.diagnosis.verdict.place, Resonator),
        resonators=[_format_resonator(entry) for entry in result.diagnosis.places if isinstance(entry, Resonator)],
        law=None if result.law is None else [*result.law.sentences],
        embedded=shown_pictures,
        law_file=LAW_FILE,
        next_step=result.next_step,
        calibration_parameters=[item for item in result.setup.calibration_parameters if item.is_of_case],
        in_case=result.setup.calibrated,
        now=list_factors(result.setup, result.diagnosis.baseline),
        then={} if result.best is None else list_factors(result.setup, result.best),
        prior_residual=_format_prior_residual,
        added=_format_added(result),
        holds=bool(result.setup.added or result.setup.calibrated),
        best=None if result.best is None or result.best.effect is None else result.best.effect.name,
        untestable=result.diagnosis.catalogue.untestable,
        history=history.steps,
        before=before.name,
        after=after.name,
    )


def _make_cards(listed: Sequence[FitStage]) -> list[dict[str, str]]:
    """Key numbers of the first, the present and the proposed model."""
    values = [summarise_errors(stage.refit) for stage in listed]

    def chain(values: Sequence[str]) -> str:
        return " → ".join(values)

    return [
        {"label": "held-out error", "value": chain([percent(item.held_out, 3) for item in values])},
        {"label": "training error", "value": chain([percent(item.training, 3) for item in values])},
        {
            "label": "held-out reduced χ² (1 is noise)",
            "value": chain([format_digits(item.held_out_chi2, 3) for item in values]),
        },
    ]


def _place(place: UnknownForcePlace) -> dict[str, Any]:
    levels = zip(place.level.tolist(), place.stiffness.tolist(), place.deviation.tolist(), strict=True)
    return {
        "name": place.name,
        "configuration": place.configuration,
        "gain": format_digits(place.gain, 4),
        "exponent": f"{place.exponent:.2f} ± {TWO_SIDED_95 * place.exponent_deviation:.2g}"
        if np.isfinite(place.exponent_deviation)
        else "",
        "phase": "" if place.phase is None else f"{place.phase:.0f}°",
        "reads": _reads(place),
        "levels": [
            f"{level:g} N: {format_digits(abs(kappa), 3)} ± {format_digits(TWO_SIDED_95 * deviation, 2)} "
            f"{place.units.stiffness}"
            for level, kappa, deviation in levels
        ],
    }


def _format_resonator(resonator: Resonator) -> dict[str, str]:
    half = format_digits(TWO_SIDED_95 * resonator.deviation, 2)
    return {
        "name": resonator.name,
        "configuration": resonator.configuration,
        "gain": format_digits(resonator.gain, 4),
        "frequency": f"{resonator.frequency:.4g} Hz",
        "damping": f"{100 * resonator.damping:.2g} %",
        "mass": f"{format_digits(resonator.mass, 3)} ± {half} {resonator.unit}",
    }


def _reads(place: UnknownForcePlace) -> str:
    """Physical interpretation of an unknown force by its phase and exponent."""
    off = {180.0: "a spring", 0.0: "inertia", -90.0: "damping"}
    phase = place.phase
    if phase is None:
        return "the phase is not the same at all levels, or depends on how much is model error"
    kind = next((words for at, words in off.items() if abs((phase - at + 180) % 360 - 180) < NEAR_PHASE), "")
    power = {1.0: "linear", 2.0: "quadratic", 3.0: "cubic"}
    grows = next((words for at, words in power.items() if abs(place.exponent - at) < NEAR_EXPONENT), "")
    if not kind:
        return f"{grows + ', ' if grows else ''}neither spring, inertia nor damping alone"
    return f"{kind}, {grows}" if grows else kind


def _format_prior_residual(factor: float, prior: float) -> dict[str, Any]:
    """Change of a calibration parameter in standard deviations of its prior, and its place on a scale [%]."""
    residual = (factor - 1) / prior
    return {
        "words": f"{residual:+.2f}",
        "place": f"{50 + 50 * max(-1.0, min(1.0, residual / 3)):.1f}",
        "far": abs(residual) > 2,
    }


def _format_factor(estimate: tuple[float, float]) -> str:
    """A factor with its 95 % interval, with sufficient decimals."""
    value, deviation = estimate
    places = 4 if deviation >= 5e-4 else 5
    return f"{value:.{places}f} ± {TWO_SIDED_95 * deviation:.{places}f}"


def _format_added(result: Round) -> list[dict[str, str]]:
    now = list_strengths(result.setup, result.diagnosis.baseline)
    then = list_strengths(result.setup, result.best) if result.best is not None else []
    listed = []
    for number, (effect, strength, deviation) in enumerate(now):
        parameter = effect.parameters[0]
        later = then[number] if number < len(then) else None
        listed.append(
            {
                "name": effect.name,
                "case": format_interval(float(result.setup.added[number].values[0]), 0.0, parameter),
                "now": format_interval(strength, deviation, parameter),
                "then": "" if later is None else format_interval(later[1], later[2], parameter),
            }
        )
    return listed
