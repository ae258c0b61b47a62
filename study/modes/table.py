"""Table of natural frequencies and damping ratios of a case whose structure has no mesh to draw."""

from collections.abc import Sequence
from math import pi

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.dense_modes import RIGID, compute_dense_modes
from geometry.plain_number import count
from pipeline.output import replace_file
from reduction.jointed_system import JointedSystem, modal_damping
from reduction.stuck import stick_at_rest
from study.case.model_doubt import warn_of_model
from study.case.setup import read_case
from study.kind.registry import OpenCase
from study.run_context import Answer, RunContext

Values = Float[NDArray[np.float64], " m"]
Matrix = Float[NDArray[np.float64], "r r"]


def write_modes_table(opened: OpenCase, run: RunContext, n_mode: int) -> Answer:
    """Write the table of the lowest modes, without joints and with all contacts that are closed at rest stuck.

    Parameters
    ----------
    opened
        Case; its calibrated values and added effects are included.
    run
        Output folder, store and progress of the run.
    n_mode
        Largest number of modes [-].
    """
    assert run.output is not None
    system = read_case(opened, run=run).model.system
    warn_of_model(opened.case, system, swept=False)
    columns = compute_frequency_columns(system, n_mode)
    file = run.output / f"{opened.path.stem}_modes.csv"
    names = list(columns)
    rows = [[value if np.isfinite(value) else None for value in row] for row in zip(*columns.values(), strict=True)]
    replace_file(file, "\n".join([",".join(["mode", *names]), *_format_csv(rows), ""]))
    words = {"hz": "frequency [Hz]", "ratio": "damping ratio [%]"}
    heads = [("stuck: " if name.startswith("stuck") else "") + words[name.rpartition("_")[2]] for name in names]
    lines = [f"{system.n_dof} degrees of freedom, {count(len(system.joints), 'joint')}", ""]
    lines.append("  mode" + "".join(f"  {head:>24}" for head in heads))
    for number, row in enumerate(rows, start=1):
        cells = (_number(value, name) for name, value in zip(names, row, strict=True))
        lines.append(f"  {number:4}" + "".join(f"  {text:>24}" for text in cells))
    if "stuck_frequency_hz" in columns:
        lines += ["", "  stuck: all contacts that are closed at rest stick; the other columns are without joints"]
    return Answer(
        document={
            "n_dof": system.n_dof,
            **{name: [row[place] for row in rows] for place, name in enumerate(names)},
            "files": [str(file)],
        },
        text="\n".join([*lines, "", str(file)]),
    )


def compute_frequency_columns(system: JointedSystem, n_mode: int) -> dict[str, Values]:
    """Natural frequencies [Hz], and damping ratios [-] if there is damping; "stuck_" columns if there are joints.

    The damping ratio is that of an undamped mode shape, phi^T (C + H / omega) phi / (2 omega); NaN for a rigid motion.
    """
    stiffnesses = {"": system.stiffness}
    if system.joints:
        stiffnesses["stuck_"] = stick_at_rest(system.stiffness, system.joints)
    columns: dict[str, Values] = {}
    for prefix, stiffness in stiffnesses.items():
        frequency, ratio = _modes(system, stiffness, n_mode)
        columns[f"{prefix}frequency_hz"] = frequency
        if system.damping.any() or system.structural_damping is not None:
            columns[f"{prefix}damping_ratio"] = ratio
    return columns


def _modes(system: JointedSystem, stiffness: Matrix, n_mode: int) -> tuple[Values, Values]:
    result = compute_dense_modes(system.mass, stiffness)
    shapes = result.mode_shapes[:, :n_mode]
    squared = result.lambda_[:n_mode]
    omega = np.sqrt(np.where(squared > RIGID * result.lambda_[-1], squared, 0.0))
    per_mass = modal_damping(system, shapes, omega)
    return omega / (2 * pi), np.divide(per_mass, 2 * omega, out=np.full(len(omega), np.nan), where=omega > 0)


def _format_csv(rows: Sequence[Sequence[float | None]]) -> list[str]:
    return [
        ",".join([str(number), *("" if value is None else f"{value:.10g}" for value in row)])
        for number, row in enumerate(rows, start=1)
    ]


def _number(value: float | None, name: str) -> str:
    if value is None:
        return "-"
    return f"{value:.5f}" if name.endswith("hz") else f"{100 * value:.4g}"
