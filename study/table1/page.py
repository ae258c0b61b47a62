"""Self-contained HTML page of a mesh study."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from casefile.quantity import format_quantity
from study.page.html import fill_template
from study.table1.study import MeshStudy

TEMPLATE = Path(__file__).with_name("page.html.j2")
#: Largest difference of a row from its published frequency with which the first study remains the default [Hz].
AIM = 0.3
#: Printed unit of a value by the last part of its key; values of other keys are lengths in mm.
SHOWN_UNIT = {"young": "GPa", "density": "kg/m^3", "cone_half_angle": "deg", "ratio": "%"}
BARE = ("kind", "poisson", "length_ratio", "drop_every", "modes")


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Picture of the page: PNG or GIF file, and its caption."""

    file: Path
    caption: str


@dataclass(frozen=True, kw_only=True)
class StudyPage:
    """Study on the page: name of its case file, figure as PNG, pictures, and name of its STEP file."""

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
    """Value of the case as text, with a length, modulus, density, angle or ratio in the unit of case files."""
    last = key.rpartition(".")[2]
    if not isinstance(value, float) or last in BARE:
        return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    return format_quantity(value, SHOWN_UNIT.get(last, "mm"))
