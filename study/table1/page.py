"""The mesh study as one self-contained HTML page."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casefile.quantity import format_quantity
from study.page.html import fill_template
from study.table1.study import MeshStudy

TEMPLATE = Path(__file__).with_name("page.html.j2")
#: The default table is the rig's if all its rows are this near the published ones [Hz].
AIM = 0.3
#: How each kind of value is written, by the end of its key; other lengths are in mm.
SHOWN_UNIT = {"young": "GPa", "density": "kg/m^3", "cone_half_angle": "deg", "ratio": "%"}
BARE = ("kind", "poisson", "length_ratio", "drop_every", "modes")


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture for the page: PNG or GIF file and its caption."""

    file: Path
    caption: str


@dataclass(frozen=True, kw_only=True)
class StudyPage:
    """A study on the page: name of its case file, figure as PNG, pictures, and name of its STEP file."""

    study: MeshStudy
    case_file: str
    figure: bytes
    pictures: Sequence[Picture]
    step: str

    @property
    def largest(self) -> dict[str, float]:
        """Largest relative differences of the first frequency [-]."""
        rows, results = self.study.rows, [row.result for row in self.study.rows]
        differences = {
            "reduced": [r.rom_frequency[0] / r.frequency[0] - 1 for r in results],
            "truncation": [r.rom_error[0] for r in results],
            "peak": [r.peak_natural / r.rom_frequency[0] - 1 for r in results],
            "calculix": [row.calculix / float(row.result.frequency[0]) - 1 for row in rows if row.calculix is not None],
        }
        return {name: max(map(abs, values)) for name, values in differences.items() if values}


def page(studies: Sequence[StudyPage]) -> str:
    """HTML of all studies, the default one first."""
    filters = {
        "as": lambda value, digits: "" if value is None else format(value, digits),
        "data": lambda content, kind: f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}",
        "quantity": _format_value,
    }
    asked = all(item.study.asked_calculix for item in studies)
    return fill_template(TEMPLATE, {}, filters, aim=AIM, asked_calculix=asked, pages=studies)


def _format_value(value: Any, key: str) -> str:
    """A number of the case in the unit that case files use."""
    last = key.rpartition(".")[2]
    if not isinstance(value, float) or last in BARE:
        return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    return format_quantity(value, SHOWN_UNIT.get(last, "mm"))
