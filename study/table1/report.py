"""Files of a mesh study: CSV, figure, pictures, STEP and page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from casefile.table import load_case, read_case_head, refuse_other_case
from figure.mesh_study import MeshConvergence, ModelFrequency
from figure.registry import pictures
from figure.scene.off_screen import require_egl
from study.kind.blade.reduce import compute_blade_shapes
from study.modes.files import picture_modes
from study.modes.shapes import Shapes
from study.run_context import RunContext
from study.table1.case import Table1Case
from study.table1.page import AIM, Picture, StudyPage, page
from study.table1.study import MeshStudy, make_row_inputs, run_study

N_PICTURED = 3
#: Columns of the CSV file, and the format of each.
COLUMNS = {
    "model": "", "element": "", "elements_through_thickness": "", "root": "", "frequency_hz": ".9g",
    "rom_frequency_hz": ".9g", "hb_peak_hz": ".9g", "paper_hz": "g", "n_dof": "", "seconds": ".2f",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Table1Report:
    """Studies in the order of the page, the default study first, and the written files."""

    studies: tuple[MeshStudy, ...]
    files: tuple[Path, ...]


def write_report(cases: Sequence[Path], run: RunContext) -> Table1Report:
    """Run the mesh studies of the given case files and write everything into the run's output folder.

    Parameters
    ----------
    cases
        Case files; the default study is the first case if all its rows are within `AIM` of the published ones, else the
        first case of which this is true, else the first case.
    run
        Output folder, store and progress.
    """
    require_egl()  # fails before the computation: the page needs pictures
    for path in cases:
        if "structure" in read_case_head(path):
            raise refuse_other_case(path, "one structure", "give a mesh study, with [[model]] tables")
    loaded = [(path, load_case(path, Table1Case)) for path in cases]
    result = [(path, run_study(case, run, f"{case.title}: models")) for path, case in loaded]
    if result[0][1].worst_error > AIM:
        result.sort(key=lambda pair: pair[1].worst_error > AIM)  # stable: the first study within AIM comes first
    files: list[Path] = []
    parts = []
    for number, (path, study) in enumerate(result):
        # Case files of the same name in two folders must not overwrite each other's results.
        alone = path.stem != "table1" and [other.stem for other, _ in result[1:]].count(path.stem) == 1
        stem = "table1" if number == 0 else path.stem if alone else f"{path.stem}_{number + 1}"
        drawn = pictures({stem: _make_convergence(study)})
        modes = _draw_pictures(study, run, stem)
        written: dict[str, str | bytes] = {
            f"{stem}.csv": format_csv(study),
            **{f"{name}.png": picture for name, picture in drawn.items()},
            f"{stem}.step": study.solid.step,
        }
        files += run.write_files(written)
        files += [picture.file for picture in modes]
        parts.append(
            StudyPage(study=study, case_file=path.name, figure=drawn[stem], pictures=modes, step=f"{stem}.step")
        )
    files += run.write_files({"table1.html": page(parts)})
    return Table1Report(studies=tuple(study for _, study in result), files=tuple(files))


def _draw_pictures(study: MeshStudy, run: RunContext, stem: str) -> list[Picture]:
    """Draw the lowest modes of the row nearest to the paper, among fully clamped quadratic rows or else all rows."""
    assert run.output is not None
    quadratic = [row for row in study.rows if row.table.element == "hex20" and row.table.root == "full"]
    row = min(quadratic or study.rows, key=lambda item: abs(item.error or 0.0))
    result: Shapes = run.store.run(compute_blade_shapes, make_row_inputs(study.case, row.table), N_PICTURED)
    files = picture_modes(result, stem, run)
    return [Picture(file=file, caption=f"{caption} (model {row.table.model})") for file, caption in files]


def _make_convergence(study: MeshStudy) -> MeshConvergence:
    """Data of the convergence figure of a study."""
    rows = [
        ModelFrequency(
            element=row.table.element,
            through_thickness=row.table.elements_through_thickness,
            frequency=float(row.result.frequency[0]),
            reference=row.table.paper,
            number=row.table.model,
            is_full=row.table.root == "full",
        )
        for row in study.rows
    ]
    untuned = [
        ModelFrequency(
            element=item.table.element,
            through_thickness=item.table.elements_through_thickness,
            frequency=float(item.result.frequency),
            reference=item.theory,
        )
        for item in study.predictions
        if item.table.thickness_factor == 1
    ]
    title = f"{study.case.title}: first natural frequency"
    return MeshConvergence(rows=rows, untuned=untuned, measured=study.case.measured, title=title)


def format_csv(study: MeshStudy) -> str:
    """Text of the CSV file, one line per model."""
    rows = [
        ["" if row.document[name] is None else format(row.document[name], digits) for name, digits in COLUMNS.items()]
        for row in study.rows
    ]
    return "\n".join([",".join(row) for row in [[*COLUMNS], *rows]] + [""])
