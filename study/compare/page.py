"""Page of a comparison: one self-contained HTML file with plotly.js, which loads nothing."""

from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from correlation.campaign.measurement import Suspicion
from study.compare.curve import Drawing
from study.compare.result import Calibrated, ComparisonResult
from study.compare.section.contact_force import make_contact_force_sections
from study.compare.section.linearity import make_linearity_sections
from study.compare.section.misfit import make_misfit_sections
from study.compare.section.overview import make_overview_sections
from study.compare.section.resonance import make_resonance_sections
from study.compare.section.response import make_response_sections
from study.compare.section.section import Section
from study.compare.sentence import Summary, summarise
from study.page.html import render_page

TEMPLATE = Path(__file__).with_name("page.html.j2")
SCRIPT = Path(__file__).with_name("page.js")
#: Sections of every comparison, if there is data for them; `ComparisonResult.sections` come before the overview.
SECTIONS: Sequence[Callable[[ComparisonResult, Drawing], Iterator[Section]]] = (
    make_response_sections,
    make_misfit_sections,
    make_resonance_sections,
    make_linearity_sections,
    make_contact_force_sections,
)


def make_page(compared: ComparisonResult, drawing: Drawing) -> str:
    """HTML of a comparison.

    Parameters
    ----------
    compared
        Comparison.
    drawing
        Its curves.
    """
    sections = [section for make in SECTIONS for section in make(compared, drawing)]
    sections += [*compared.sections, *make_overview_sections(compared, drawing)]
    return render_sections(
        title=compared.title,
        campaign=compared.campaign.title,
        summary=summarise(compared),
        calibrated=compared.calibrated,
        suspicions=compared.suspicions,
        sections=sections,
    )


def render_sections(
    *,
    title: str,
    campaign: str,
    summary: Summary,
    calibrated: Sequence[Calibrated],
    suspicions: Sequence[Suspicion],
    sections: Sequence[Section],
    kind: str = "Comparison",
) -> str:
    """HTML of a verdict and the sections below it.

    Parameters
    ----------
    title, campaign
        Titles of the case and of the campaign.
    summary
        Verdict.
    calibrated
        Calibration parameters, if they were fitted first.
    suspicions
        Suspicious data.
    sections
        Sections in reading order.
    kind
        Kind of the page, above its title.
    """
    drawn = {
        "sections": [
            {"element": section.element, "data": section.data, "plots": list(section.plots)} for section in sections
        ]
    }
    return render_page(
        TEMPLATE,
        SCRIPT,
        drawn,
        {"png": lambda picture: f"data:image/png;base64,{b64encode(picture).decode()}"},
        title=title,
        campaign=campaign,
        summary=summary,
        calibrated=calibrated,
        suspicions=suspicions,
        sections=sections,
        kind=kind,
    )
