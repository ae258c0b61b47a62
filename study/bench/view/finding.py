"""View of what follows from a verdict: the recovered law if no effect explains the data, and the next test."""

from base64 import b64encode
from typing import Any

from figure.registry import pictures
from study.diagnose.law_drawing import make_law_drawing
from study.diagnose.next_test_drawing import make_next_tests
from study.diagnose.report import LAW_FILE
from study.diagnose.round import Round


def show_law(result: Round) -> dict[str, Any] | None:
    """Make the view of the recovered law: words, picture and effect file; None without a law."""
    law = result.law
    if law is None:
        return None
    return {
        "sentences": law.sentences,
        "picture": _draw(make_law_drawing(law, result.setup.title)),
        "name": law.name,
        "file": LAW_FILE,
        "text": law.effect_file,
    }


def show_next_tests(result: Round) -> dict[str, Any] | None:
    """Make the view of the next tests, with their probabilities to decide; None if there is nothing to separate."""
    step = result.next_step
    if step.advice is None:
        return {"sentence": step.reason, "rows": [], "remark": "", "picture": ""} if step.reason else None
    units = {item.name: item.unit for item in result.campaign.sensors}
    return {
        "sentence": f"{step.sentence[0].upper()}{step.sentence[1:]}.",
        "between": list(step.advice.names),
        "rows": [
            {"probability": item.probability, "minutes": item.test.minutes, "title": item.test.title}
            for item in step.shown
        ],
        "remark": step.remark,
        "picture": _draw(make_next_tests(step, result.setup.title, units)),
    }


def _draw(drawing: object) -> str:
    """Draw a picture as base64."""
    return b64encode(pictures({"picture": drawing})["picture"]).decode()
