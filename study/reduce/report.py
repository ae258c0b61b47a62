"""Report of ``stickslip reduce`` on reduced bodies and their fixed-interface modes, as a table and as a document."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fe.mode_check import ModeCheck
from reduction.assembly import ReducedAssembly
from study.case.model_doubt import warn_of_frequency
from study.reduce.comparison import ComparedReduction
from study.run_context import Answer


def report_reduction(
    result: ComparedReduction,
    n_asked: int,
    check: ModeCheck | None,
    files: Sequence[Path],
    *,
    head: Sequence[str] = (),
    notes: Sequence[str] = (),
    facts: Mapping[str, Any] = MappingProxyType({}),
) -> Answer:
    """Report the natural frequencies of one reduced body, with its truncation errors and the check of its modes.

    Parameters
    ----------
    result
        Reduction.
    n_asked
        Number of fixed-interface modes that the case requests [-].
    check
        Check of these modes, or None.
    files
        Written files.
    head, notes
        Lines above and below the table.
    facts
        Further entries of the document.
    """
    warn_of_frequency(float(result.frequency[0]) if len(result.frequency) else 0.0)
    names = [str(file) for file in files]
    table = zip(result.frequency, result.rom_frequency, result.rom_error, strict=True)
    lines = [
        *head,
        f"{result.n_dof} degrees of freedom reduced to {result.rom.n_dof}",
        *report_fewer_modes(len(result.rom.fixed_interface_frequency), n_asked),
        "",
        "  mode      full [Hz]   reduced [Hz]   estimated truncation error",
        *(
            f"  {number:4} {full:14.5f} {rom:14.5f}   {error:26.1e}"
            for number, (full, rom, error) in enumerate(table, start=1)
        ),
        "",
        (
            "  The error is only that of the omitted modes; errors of the full model, such as that of its mesh, are "
            "not included."
        ),
        *([] if check is None else ["", f"  {describe_check(check)}"]),
        *notes,
        "",
        *names,
    ]
    document = {
        "n_dof": result.n_dof,
        "n_reduced": result.rom.n_dof,
        "n_mode": len(result.rom.fixed_interface_frequency),
        "frequency_hz": list(map(float, result.frequency)),
        "rom_frequency_hz": list(map(float, result.rom_frequency)),
        "rom_error": list(map(float, result.rom_error)),
        **({} if check is None else {"mode_check": document_check(check)}),
        **facts,
        "files": names,
    }
    return Answer(document=document, text="\n".join(lines))


def describe_check(check: ModeCheck) -> str:
    """Sentence on the residuals of the modes, and on modes that are missed or found twice."""
    below = f"below {np.sqrt(check.shift) / (2 * np.pi):.6g} Hz"
    counted = f"{check.n_found} fixed-interface modes {below}, residuals of at most {check.residual.max():.0e}"
    if check.n_missed > 0:
        return f"{counted}, but {check.n_below} exist: {check.n_missed} MISSED"
    if check.n_missed < 0:
        return f"{counted}, but only {check.n_below} exist: {-check.n_missed} FOUND TWICE"
    return f"{counted}, none missed"


def document_check(check: ModeCheck) -> dict[str, Any]:
    """Check of the modes as entries of the JSON document."""
    return {
        "largest_residual": float(check.residual.max()),
        "counted_below_hz": float(np.sqrt(check.shift) / (2 * np.pi)),
        "n_below": check.n_below,
        "n_found": check.n_found,
    }


def report_fewer_modes(n_mode: int, n_asked: int, body: str = "the interior", key: str = "modes") -> list[str]:
    """One sentence if there are fewer modes than requested, else none.

    Parameters
    ----------
    n_mode, n_asked
        Numbers of kept and of requested modes [-].
    body, key
        Body of these modes, and key of their number in the case.
    """
    if n_mode >= n_asked:
        return []
    return [f"all {n_mode} fixed-interface modes of {body} are kept: there are no more, although {key} = {n_asked}"]


def report_fewer_rig_modes(assembly: ReducedAssembly, asked: int | Mapping[str, int]) -> list[str]:
    """One sentence for each request that a rig does not reach; `asked` is for all bodies together, or for each body."""
    counts = {body: len(rom.fixed_interface_frequency) for body, rom in assembly.bodies.items()}
    if isinstance(asked, Mapping):
        return [sentence for body, n in asked.items() for sentence in report_fewer_modes(counts[body], n, body, body)]
    return report_fewer_modes(sum(counts.values()), asked, "the bodies")
