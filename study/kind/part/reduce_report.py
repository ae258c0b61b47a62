"""Tables of a reduced part: named faces of its solid; frequencies and stations with their frames as CSV."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from geometry.interface import ContactLine
from geometry.part import MILLIMETRES_PER_METRE
from study.kind.part.stages import NamedFaces
from study.reduce.comparison import ComparedReduction


def format_face_lines(faces: Mapping[str, NamedFaces]) -> list[str]:
    """Format a line for each named face, with the number of CAD faces that its selector found; empty without names."""
    if not faces:
        return []
    width = max(4, *map(len, faces))
    return [
        f"  {'face':{width}}   CAD faces   area [mm^2]   mean position [mm]",
        *(
            f"  {name:{width}} {item['n_face']:11} {item['area_mm2']:13.2f}   "
            f"({', '.join(f'{x:.2f}' for x in item['centre_mm'])})"
            for name, item in document_faces(faces).items()
        ),
    ]


def document_faces(faces: Mapping[str, NamedFaces]) -> dict[str, dict[str, Any]]:
    """Make the JSON document of the named faces."""
    return {
        name: {
            "n_face": item.n_face,
            "area_mm2": item.area * MILLIMETRES_PER_METRE**2,
            # Rounded, because the mean position of a symmetric face may be round-off with a sign.
            "centre_mm": (np.round(item.centre * MILLIMETRES_PER_METRE, 9) + 0.0).tolist(),
        }
        for name, item in faces.items()
    }


def format_frequency_table(result: ComparedReduction) -> str:
    """Format full and reduced frequencies [Hz] and the estimated truncation error [-] as CSV."""
    lines = [
        f"{number},{full:.9g},{rom:.9g},{error:.3g}"
        for number, (full, rom, error) in enumerate(
            zip(result.frequency, result.rom_frequency, result.rom_error, strict=True), start=1
        )
    ]
    return "\n".join(["mode,full_hz,reduced_hz,estimated_error", *lines, ""])


def format_station_table(lines: Mapping[str, ContactLine]) -> str:
    """Format the stations as CSV: coordinates, outward normal, tangents along and across, tributary length [m, -]."""
    axes = "xyz"
    head = ["name", "station", *axes]
    head += [f"{vector}_{axis}" for vector in ("normal", "along", "across") for axis in axes]
    rows = [",".join([*head, "length"])]
    for name, line in lines.items():
        for k in range(line.n_station):
            values = [*line.stations[k], *line.normal[k], *line.tangents[k].ravel(), line.tributary_length[k]]
            # Adding 0.0 makes a negative zero positive.
            rows.append(",".join([f'"{name}"', str(k), *(f"{value + 0.0:.12g}" for value in values)]))
    return "\n".join([*rows, ""])
