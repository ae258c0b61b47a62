"""A diagnosis is noted in the history of its case."""

from pathlib import Path

from study.diagnose.history import DIAGNOSIS, Step, case_key, history_of, read_text
from study.diagnose.report import headline
from study.diagnose.round import Round, errors
from study.diagnose.table import write_up


def record(found: Round, case: Path, campaign: Path) -> Step:
    """Note a diagnosis in the history of its case, so that `add` knows the strengths that it found.

    Parameters
    ----------
    found
        The round.
    case, campaign
        The file and the folder that it is of.
    """
    history, key = history_of(case), case_key(read_text(case))
    before, drawn = errors(found.diagnosis.before), errors(found.drawn)
    added = {each.effect.name for each in found.setup.added}
    # What the accepted parameters alone achieve is known from a diagnosis before anything was added.
    told = [each.accepted for each in history.steps if each.accepted is not None and each.campaign == str(campaign)]
    earlier = told[-1] if told else None
    step = Step(
        what=DIAGNOSIS,
        case_key=key,
        campaign=str(campaign),
        sentence=headline(found),
        finding=found.diagnosis.verdict.finding.value,
        drawn=drawn,
        accepted=earlier if found.setup.added else before,
        before=before,
        candidates=[
            write_up(found, each) for each in found.diagnosis.refits if each.effect and each.effect.name not in added
        ],
    )
    history = history.with_step(step)
    history.save()
    return history.steps[-1]
