"""A diagnosis as one self-contained HTML page: plotly.js is in it, and nothing is loaded from anywhere."""

import importlib.metadata
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from diagnosis.decision.verdict import INTERVAL, Finding
from diagnosis.localisation import Place
from figure.misfit_map import COLOURS, STEPS
from study.console import plain
from study.diagnose.curves import curves, maps
from study.diagnose.history import ADD, DIAGNOSIS, Errors, History, Step
from study.diagnose.report import advice, chance, headline
from study.diagnose.round import Round, errors
from study.diagnose.stages import Stage, falls, stages, waterfall
from study.diagnose.table import ALIKE, Row, beyond, digits, factors, interval, rows, strengths

TEMPLATE = Path(__file__).with_name("page.html.j2")
SCRIPT = Path(__file__).with_name("page.js")
#: Candidates that are shown without being asked for.
SHOWN = 8
#: An exponent or phase is called by a name if it is this near [-, deg].
NEAR_EXPONENT, NEAR_PHASE = 0.35, 25.0


def page(of: Round, history: History) -> str:
    """HTML of a round.

    Parameters
    ----------
    of
        The round.
    history
        Of its case.
    """
    from jinja2 import Environment, StrictUndefined
    from plotly.offline import get_plotlyjs

    found, candidates = stages(of), rows(of)
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    before, after = (found[-2], found[-1])
    falling = waterfall(of, history)
    drawn = {
        "waterfall": [vars(step) for step in falling],
        # Three kinds of lines are as many as an eye can follow.
        "curves": curves(of, list(dict.fromkeys([found[0], before, after]))),
        "maps": maps(of, [before, after]),
        "mapNames": [before.name, after.name],
        "steps": list(STEPS),
        "mapColours": list(COLOURS),
    }
    return template.render(
        version=importlib.metadata.version("stickslip"),
        title=of.setup.title,
        campaign=of.campaign.title,
        finding=of.diagnosis.verdict.finding.value,
        headline=set_in_type(headline(of)),
        advice=advice(of),
        chance=set_in_type(chance(of)),
        cards=_cards(found),
        chain=" → ".join(stage.name for stage in found),
        falls=falls(falling),
        candidates=[_candidate(row) for row in candidates],
        n_shown=SHOWN,
        held_before=f"{100 * of.diagnosis.before.held_error:.3g}",
        detectable=_detectable(candidates),
        is_nothing=of.diagnosis.verdict.finding is Finding.NOTHING,
        places=[_place(place) for place in of.diagnosis.places],
        accepted=_accepted(of),
        added=_added(of),
        holds=bool(of.setup.added or of.setup.calibrated),
        best=None if of.best is None or of.best.effect is None else of.best.effect.name,
        untestable=of.diagnosis.catalogue.untestable,
        history=[_step(step) for step in history.steps],
        before=before.name,
        after=after.name,
        data=_script_safe(json.dumps(plain(drawn), ensure_ascii=False, separators=(",", ":"))),
        plotly=_script_safe(get_plotlyjs()),
        script=SCRIPT.read_text(encoding="utf-8"),
    )


def set_in_type(text: str) -> str:
    """Words as they are printed: ± for +-, χ² for chi^2, µm for um, raised exponents."""
    text = text.replace("+-", "±").replace("chi^2", "χ²").replace("^2", "²").replace("^3", "³")
    return re.sub(r"\bum\b", "µm", text).replace(" %", "\u00a0%")


def _script_safe(text: str) -> str:
    """Text that cannot end the script element that it stands in."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def _cards(found: Sequence[Stage]) -> list[dict[str, str]]:
    """Key numbers of the first, the present and the proposed model."""
    told = [errors(stage.refit) for stage in found]

    def chain(values: Sequence[str]) -> str:
        return " → ".join(values)

    return [
        {"label": "held-out error", "value": chain([f"{100 * each.held_out:.3g} %" for each in told])},
        {"label": "training error", "value": chain([f"{100 * each.training:.3g} %" for each in told])},
        {
            "label": "held-out χ² a number (1 is noise)",
            "value": chain([digits(each.held_out_chi2, 3) for each in told]),
        },
    ]


def _candidate(row: Row) -> dict[str, Any]:
    return {
        "name": row.effect.name,
        "physics": row.effect.physics,
        "signature": row.effect.signature,
        "named": row.named,
        "fitted": row.gain is not None,
        "gain": digits(row.expected if row.gain is None else row.gain, 4),
        "held_out": "" if row.errors is None else f"{100 * row.errors.held_out:.3g}",
        "held_out_chi2": "" if row.errors is None else f"{row.errors.held_out_chi2:.3g}",
        "strength": set_in_type(row.in_words),
        "cosine": f"{row.cosine:.2f}",
        "percent": round(100 * row.cosine),
        "alike": row.cosine > ALIKE,
        "detectable": set_in_type(beyond(row.detectable, row.parameter)),
    }


def _detectable(candidates: Sequence[Row]) -> list[dict[str, Any]]:
    """Least strengths by kind."""
    found: dict[str, list[dict[str, str]]] = {}
    for row in candidates:
        where = row.effect.name.removeprefix(row.effect.kind).strip() or row.effect.name
        found.setdefault(row.effect.kind, []).append(
            {"where": where, "strength": set_in_type(beyond(row.detectable, row.parameter))}
        )
    return [{"kind": kind, "each": each} for kind, each in sorted(found.items())]


def _place(place: Place) -> dict[str, Any]:
    levels = zip(place.level.tolist(), place.stiffness.tolist(), place.deviation.tolist(), strict=True)
    return {
        "name": place.name,
        "configuration": place.configuration,
        "gain": digits(place.gain, 4),
        "exponent": f"{place.exponent:.2f} ± {INTERVAL * place.exponent_deviation:.2g}",
        "phase": f"{place.phase:.0f}",
        "reads": _reads(place),
        "levels": [
            f"{level:g} N: {digits(abs(kappa), 3)} ± {digits(INTERVAL * deviation, 2)} N/m"
            for level, kappa, deviation in levels
        ],
    }


def _reads(place: Place) -> str:
    """What such a force could be."""
    off = {180.0: "a spring", 0.0: "inertia", -90.0: "damping"}
    kind = next((words for at, words in off.items() if abs((place.phase - at + 180) % 360 - 180) < NEAR_PHASE), "")
    power = {1.0: "linear", 2.0: "quadratic", 3.0: "cubic"}
    grows = next((words for at, words in power.items() if abs(place.exponent - at) < NEAR_EXPONENT), "")
    if not kind:
        return f"{grows + ', ' if grows else ''}neither spring, inertia nor damping alone"
    return f"{kind}, {grows}" if grows else kind


def _accepted(of: Round) -> list[dict[str, str]]:
    now = factors(of, of.diagnosis.before)
    then = {} if of.best is None else factors(of, of.best)
    listed = []
    for each in of.setup.accepted:
        # How far it moved in the fit that the verdict is about.
        pull = (then.get(each.name, now[each.name])[0] - 1) / each.deviation
        listed.append(
            {
                "name": each.name,
                "physics": each.physics,
                "prior": f"1 ± {100 * each.deviation:.3g} %",
                "case": f"{of.setup.calibrated.get(each.name, 1.0):.4f}",
                "now": _factor(*now[each.name]),
                "then": "" if each.name not in then else _factor(*then[each.name]),
                "pull": f"{pull:+.2f}",
                "place": f"{50 + 50 * max(-1.0, min(1.0, pull / 3)):.1f}",
                "far": "far" if abs(pull) > 2 else "",
            }
        )
    return listed


def _factor(value: float, deviation: float) -> str:
    """With its 95 % interval, and as many places as that needs."""
    places = 4 if deviation >= 5e-4 else 5
    return f"{value:.{places}f} ± {INTERVAL * deviation:.{places}f}"


def _added(of: Round) -> list[dict[str, str]]:
    now = strengths(of, of.diagnosis.before)
    then = strengths(of, of.best) if of.best is not None else []
    listed = []
    for number, (effect, strength, deviation) in enumerate(now):
        parameter = effect.parameters[0]
        later = then[number] if number < len(then) else None
        listed.append(
            {
                "name": effect.name,
                "case": set_in_type(interval(float(of.setup.added[number].values[0]), 0.0, parameter)),
                "now": set_in_type(interval(strength, deviation, parameter)),
                "then": "" if later is None else set_in_type(interval(later[1], later[2], parameter)),
            }
        )
    return listed


def _step(step: Step) -> dict[str, Any]:
    values = ", ".join(str(value) for value, _ in step.values.values())
    words = {
        DIAGNOSIS: f"diagnosed: {step.sentence}",
        ADD: f"added {step.effect} ({values})",
    }.get(step.what, f"took back {step.effect}")
    return {
        "what": step.what,
        "when": step.when.replace("T", " ")[:16],
        "words": set_in_type(words),
        "errors": _fall(step.before, step.after),
        "diff": [{"text": line, "kind": _kind(line)} for line in step.diff[2:]],
    }


def _fall(before: Errors | None, after: Errors | None) -> str:
    if before is None or after is None:
        return ""
    return (
        f"held-out error {100 * before.held_out:.3g} → {100 * after.held_out:.3g} %, training "
        f"{100 * before.training:.3g} → {100 * after.training:.3g} %"
    )


def _kind(line: str) -> str:
    return {"+": "plus", "-": "minus", "@": "at"}.get(line[:1], "")
