"""What ``stickslip reduce`` says of one reduced body: a table for people, a document for programs."""

from typing import Any

from fe.mode_check import ModeCheck
from study.kind.blade.reduction import Reduction
from study.reduce.comparison import ComparedReduction
from study.reduce.mode_check import check_document, check_sentence
from study.reduce.mode_count import fewer_modes


def frequency_lines(found: Reduction | ComparedReduction, n_asked: int, check: ModeCheck | None) -> list[str]:
    """The frequencies, and what must be known of them; `n_asked` modes were to be kept."""
    return [
        f"{found.n_dof} degrees of freedom reduced to {found.rom.n_dof}",
        *fewer_modes(len(found.rom.fixed_interface_frequency), n_asked),
        "",
        "  mode      full [Hz]   reduced [Hz]   estimated truncation error",
        *(
            f"  {number:4} {full:14.5f} {rom:14.5f}   {error:26.1e}"
            for number, (full, rom, error) in enumerate(
                zip(found.frequency, found.rom_frequency, found.rom_error, strict=True), start=1
            )
        ),
        "",
        "  The error is that of the modes left out alone: what the full model errs, as by its mesh, is not in it.",
        *([] if check is None else ["", f"  {check_sentence(check)}"]),
    ]


def frequency_document(found: Reduction | ComparedReduction, check: ModeCheck | None) -> dict[str, Any]:
    """The same for programs."""
    return {
        "n_dof": found.n_dof,
        "n_reduced": found.rom.n_dof,
        "n_mode": len(found.rom.fixed_interface_frequency),
        "frequency_hz": list(map(float, found.frequency)),
        "rom_frequency_hz": list(map(float, found.rom_frequency)),
        "rom_error": list(map(float, found.rom_error)),
        **({} if check is None else {"mode_check": check_document(check)}),
    }
