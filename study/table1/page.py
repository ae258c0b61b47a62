"""The mesh study as one self-contained HTML page."""

import base64
import importlib.metadata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casefile.quantity import format_quantity
from study.table1.case import Table1Case
from study.table1.study import MeshStudy, StudyRow

TEMPLATE = Path(__file__).with_name("page.html.j2")
#: The default table is the rig's if all its rows are this near the published ones [Hz].
AIM = 0.3
#: How each kind of value is shown, by the end of its key; other lengths are in mm.
SHOWN_UNIT = {"young": "GPa", "density": "kg/m^3", "cone_half_angle": "deg", "ratio": "%"}
BARE = ("kind", "poisson", "length_ratio", "drop_every", "modes")


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture for the page: PNG or GIF file and its caption."""

    file: Path
    caption: str


def page(studies: Sequence[tuple[MeshStudy, str, bytes, Sequence[Picture], str]]) -> str:
    """HTML of all studies, the default one first.

    Parameters
    ----------
    studies
        Of each: the study, the name of its case file, its figure as PNG, its pictures, the name of its STEP file.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=False)
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    return template.render(
        version=importlib.metadata.version("stickslip"),
        aim=AIM,
        asked_calculix=all(study.asked_calculix for study, *_ in studies),
        studies=[_study(*each) for each in studies],
    )


def _study(study: MeshStudy, case_file: str, figure: bytes, pictures: Sequence[Picture], step: str) -> dict[str, Any]:
    case = study.case
    results = [row.result for row in study.rows]
    witnessed = [row.calculix / float(row.result.frequency[0]) - 1 for row in study.rows if row.calculix is not None]
    return {
        "title": case.title,
        "worst": f"{study.worst_error:.2f}",
        "measured": f"{case.measured:g}",
        "rows": [_row(row) for row in study.rows],
        "rom_difference": _largest([r.rom_frequency[0] / r.frequency[0] - 1 for r in results]),
        "rom_error": _largest([r.rom_error[0] for r in results]),
        "peak_difference": _largest([r.peak_natural / r.rom_frequency[0] - 1 for r in results]),
        "calculix_difference": _largest(witnessed) if witnessed else "",
        "figure": _data(figure, "png"),
        "predictions": [
            {
                "name": untuned.asked.name,
                "frequency": f"{found.frequency:.3f}",
                "theory": f"{untuned.theory:.2f}",
                "theory_difference": f"{100 * (untuned.theory / found.frequency - 1):+.2f} %",
                "calculix": "" if found.calculix is None else f"{found.calculix:.3f}",
                "calculix_difference": "" if found.calculix is None else f"{found.calculix / found.frequency - 1:+.0e}",
            }
            for untuned in study.predictions
            for found in [untuned.result]
        ],
        "nested": _nested(study),
        "limit": _limit(study),
        "no_limit": study.no_limit,
        "cad_volume": f"{study.solid.cad_volume * 1e9:,.1f}",
        "volume_difference": f"{study.solid.mesh_volume / study.solid.cad_volume - 1:+.1e}",
        "step": step,
        "pictures": [
            {"data": _data(picture.file.read_bytes(), picture.file.suffix[1:]), "caption": picture.caption}
            for picture in pictures
        ],
        "tuned": case.tuned,
        "case_file": case_file,
        "numbers": _numbers(case),
    }


def _row(row: StudyRow) -> dict[str, Any]:
    asked, result = row.asked, row.result
    return {
        "model": asked.model,
        "element": asked.element,
        "n": asked.elements_through_thickness,
        "root": asked.root,
        "paper": "" if asked.paper is None else f"{asked.paper:.1f}",
        "full": f"{result.frequency[0]:.3f}",
        "difference": "" if row.error is None else f"{row.error:+.2f}",
        "far": row.error is not None and abs(row.error) > AIM,
        "rom": f"{result.rom_frequency[0]:.3f}",
        "peak": f"{result.peak_natural:.3f}",
        "calculix": "" if row.calculix is None else f"{row.calculix:.3f}",
        "second": f"{result.frequency[1]:.1f}",
        "n_dof": f"{result.n_dof:,}",
        "n_held": f"{result.n_held:,}",
        "seconds": f"{result.seconds:.1f}",
        "memory": f"{result.memory / 1e9:.2f}",
    }


def _nested(study: MeshStudy) -> list[dict[str, Any]]:
    if study.case.limit is None:
        return []
    return [
        {"times": times, "n_dof": f"{point.n_dof:,}", "frequency": f"{point.frequency:.3f}"}
        for times, point in zip(study.case.limit.subdivisions, study.nested, strict=True)
    ]


def _limit(study: MeshStudy) -> dict[str, Any] | None:
    if study.limit is None or study.case.limit is None:
        return None
    return {
        "frequency": f"{study.limit.frequency:.2f}",
        "order": f"{study.limit.order:.2f}",
        "theory": study.limit.theory,
        "warning": study.limit.warning,
        "element": study.case.limit.element,
    }


def _numbers(case: Table1Case) -> list[dict[str, str]]:
    """Every number of the case outside its rows, in the units of the case files."""
    return [
        {"key": key, "value": _shown(key, value), "tuned": "tuned" if key in case.tuned else ""}
        for key, value in case.numbers.items()
    ]


def _shown(key: str, value: Any) -> str:
    last = key.rpartition(".")[2]
    if not isinstance(value, float) or last in BARE:
        return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    return format_quantity(value, SHOWN_UNIT.get(last, "mm"))


def _largest(values: Sequence[float]) -> str:
    return f"{max(abs(value) for value in values):.1e}"


def _data(content: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
