"""Page and figures of a diagnosis."""

from pathlib import Path

from figure.candidates import CandidateBar, Candidates
from figure.registry import pictures
from figure.waterfall import Waterfall
from study.compare.report import side_by_side
from study.diagnose.history import History
from study.diagnose.page import page, set_in_type
from study.diagnose.round import Round
from study.diagnose.stages import falls, waterfall
from study.diagnose.table import rows

#: Candidates drawn.
MOST = 16


def contents(of: Round, history: History, case: Path) -> dict[str, bytes]:
    """Files by their names: the page and the figures of a round.

    Parameters
    ----------
    of
        The last round.
    history
        Of its case.
    case
        Its file.
    """
    steps, found = waterfall(of, history), rows(of)[:MOST]
    title = side_by_side(of.setup.title, of.campaign.title)
    stem = f"{case.stem}_diagnosis"
    files = {f"{stem}.html": page(of, history).encode()}
    drawn: dict[str, object] = {f"{stem}_waterfall": Waterfall(steps=steps, title=title, subtitle=falls(steps))}
    if found:
        drawn[f"{stem}_candidates"] = Candidates(
            candidates=[
                CandidateBar(
                    name=row.effect.name,
                    gain=row.expected if row.gain is None else row.gain,
                    is_fitted=row.gain is not None,
                    is_named=row.named,
                    held_out=None if row.errors is None else row.errors.held_out,
                    strength=set_in_type(row.in_words),
                )
                for row in found
            ],
            threshold=of.diagnosis.thresholds.gain,
            before=of.diagnosis.before.held_error,
            title=title,
            subtitle="candidates, those named and fitted first; chance seldom exceeds "
            f"{of.diagnosis.thresholds.gain:.3g} (dashed)",
        )
    return files | {f"{name}.png": picture for name, picture in pictures(drawn).items()}
