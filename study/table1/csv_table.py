"""The mesh study as a CSV file."""

import csv
import io

from study.table1.study import MeshStudy

COLUMNS = (
    "model",
    "element",
    "elements_through_thickness",
    "root",
    "frequency_hz",
    "rom_frequency_hz",
    "hb_peak_hz",
    "paper_hz",
    "n_dof",
    "seconds",
)


def csv_table(study: MeshStudy) -> str:
    """One line a model; `hb_peak_hz` is the peak with its damping shift taken out, frequencies with nine digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in study.rows:
        asked, result = row.asked, row.result
        writer.writerow(
            [
                asked.model,
                asked.element,
                asked.elements_through_thickness,
                asked.root,
                f"{result.frequency[0]:.9g}",
                f"{result.rom_frequency[0]:.9g}",
                f"{result.peak_natural:.9g}",
                "" if asked.paper is None else f"{asked.paper:g}",
                result.n_dof,
                f"{result.seconds:.2f}",
            ]
        )
    return text.getvalue()
