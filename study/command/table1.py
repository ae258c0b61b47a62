"""``stickslip table1``: run the mesh study of the paper's Table 1."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_openblas_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, make_command_app

if TYPE_CHECKING:
    from rich.table import Table

    from study.table1.report import Table1Report
    from study.table1.study import MeshStudy

app = make_command_app(
    "table1",
    """Compute the first frequency of ten models of the stand-alone blade in three ways, and compare it with the
    published one.

    Full finite elements, Craig-Bampton, and the peak of the harmonic-balance response; also rows that were not
    used for tuning, the limit of nested meshes, and CalculiX on the same meshes if it is installed. Writes table1.csv,
    table1.html, figures, pictures and STEP files. Without a case file both shipped cases run: the rig's blade, and a
    plain one.""",
    examples=["stickslip table1 --out table1", "stickslip table1 my_blade.toml --out mine", "stickslip table1 --json"],
)


@app.default
def table1(
    cases: Annotated[
        tuple[Path, ...], Parameter(help="Case files; default: the two that are shipped.", negative="")
    ] = (),
    /,
    *,
    out: Out = Path("table1"),
    options: Options = DEFAULTS,
) -> Answer:
    """Run the mesh study."""
    set_one_openblas_thread_by_default()
    from study.shipped_cases import TABLE1
    from study.table1.report import write_report

    report = write_report(cases or TABLE1, options.open(out))
    studies = [
        {"title": item.case.title, "worst_error_hz": item.worst_error, "rows": [row.document for row in item.rows]}
        for item in report.studies
    ]
    document = {"studies": studies, "files": [str(file) for file in report.files]}
    return Answer(document=document, text=_make_table(report.studies[0], report))


def _make_table(study: "MeshStudy", report: "Table1Report") -> "Table":
    from rich.table import Table

    table = Table(
        title=f"Table 1, {study.case.title.lower()}: first frequency [Hz]",
        caption=f"page: {report.files[-1]}",
        title_justify="left",
        caption_justify="left",
    )
    for name in ("model", "element", "n", "root", "paper", "full FE", "error", "reduced", "HB peak"):
        table.add_column(name, justify="left" if name in ("element", "root") else "right", no_wrap=True)
    for row in study.rows:
        entry, result = row.table, row.result
        table.add_row(
            str(entry.model),
            entry.element,
            str(entry.elements_through_thickness),
            entry.root,
            "" if entry.paper is None else f"{entry.paper:.1f}",
            f"{result.frequency[0]:.3f}",
            "" if row.error is None else f"{row.error:+.2f}",
            f"{result.rom_frequency[0]:.3f}",
            f"{result.peak_natural:.3f}",
        )
    return table
