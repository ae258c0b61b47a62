"""What a page shows of data of other types than steady states: numbers, curves, modes and decays."""

from collections.abc import Sequence

from correlation.data_type.registry import Datum
from correlation.model import Model
from figure.registry import pictures
from study.compare.data import DataComparison, data_figures, data_sections
from study.compare.section.section import Section


def show_data(
    model: Model, data: Sequence[Datum], compared: Sequence[DataComparison], title: str
) -> tuple[dict[str, bytes], tuple[Section, ...]]:
    """Pictures by the names of their files, and the sections that have them.

    Parameters
    ----------
    model, data, compared
        Model, data of a campaign, and what `compare_data` finds of them.
    title
        Of the case.
    """
    if not data:
        return {}, ()
    # Most campaigns have no such data.
    from study.compare.modal_view import view_modes
    from study.compare.section.modal import modal_sections

    view = view_modes(model, data, compared, title)
    drawn = pictures({**data_figures(model, data, title), **view.figures})
    return drawn, (*modal_sections(view, drawn), *data_sections(compared, drawn))
