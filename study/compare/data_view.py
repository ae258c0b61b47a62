"""Page contents for data other than steady states: numbers, curves, modes and decays."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

from correlation.data_type.registry import Datum
from correlation.model import Model
from figure.registry import pictures
from figure.style import TitledFigure
from study.compare.data import DataComparison, make_data_figures, make_data_sections
from study.compare.section.section import Section


def show_data(
    model: Model, data: Sequence[Datum], compared: Sequence[DataComparison], title: str
) -> tuple[dict[str, bytes], tuple[Section, ...]]:
    """Pictures by the names of their files, and their sections.

    Parameters
    ----------
    model, data, compared
        Model, data of a campaign, and the result of `compare_data`.
    title
        Title of the case.
    """
    if not data:
        return {}, ()
    # Most campaigns have no such data.
    from study.compare.modal_view import view_modes
    from study.compare.section.modal import make_modal_sections

    view = view_modes(model, data, compared, title)
    results = {**make_data_figures(model, data, title), **view.figures}
    drawn = pictures(results)
    captions = make_captions(results, title)
    return drawn, tuple(
        replace(section, pictures={captions.get(name, name): picture for name, picture in section.pictures.items()})
        for section in (*make_modal_sections(view, drawn), *make_data_sections(compared, drawn))
    )


def make_captions(results: Mapping[str, object], title: str) -> dict[str, str]:
    """Captions of figures by the names of their files, all different: their titles without that of the case.

    Parameters
    ----------
    results
        Results to draw; a result without a title has no caption.
    title
        Title of the case.
    """
    captions: dict[str, str] = {}
    for name, result in results.items():
        if isinstance(result, TitledFigure):
            words = ": ".join(part for part in (result.title.removeprefix(f"{title}: "), result.subtitle) if part)
            numbered = itertools.chain([words], (f"{words} ({number})" for number in itertools.count(2)))
            captions[name] = next(caption for caption in numbered if caption not in captions.values())
    return captions
