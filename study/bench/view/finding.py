"""What a verdict leaves to do: the recovered law of what no effect explains, and what to measure next."""

from base64 import b64encode
from typing import Any

from figure.registry import pictures
from study.diagnose.law_drawing import make_law_drawing
from study.diagnose.next_test_drawing import make_next_tests
from study.diagnose.report import LAW_FILE
from study.diagnose.round import Round


def show_law(result: Round) -> dict[str, Any] | None:
    """The recovered law in words and as a picture, and the file that makes an effect of it; None if there is none."""
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
    """Advice on the next test, each test with the probability that it decides; None if nothing is to be separated."""
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
    """A picture as base64."""
    return b64encode(pictures({"picture": drawing})["picture"]).decode()
