"""The beam of the virtual test bench as a case: ``beam.npz`` with its matrices and rows, ``beam.toml`` with the rest.

``beam_finer.npz`` and ``beam_finer.toml`` have twice the elements and more harmonics: the difference of the responses
is the numerical error. The drawing has exactly three contacts per line: their shares of the line have no error.

``python -m study.beam.case FOLDER`` writes all four files; ``--campaign SEED`` adds measurements of a specimen on the
virtual test bench with a hidden effect drawn by the seed.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from zipfile import ZIP_DEFLATED

import numpy as np

from correlation.model import LineSensor, Model, Sensor
from reduction.file.npz import write_npz
from study.beam.model import (
    DAMPING_RATIO,
    FRICTION_COEFFICIENT,
    GAP,
    NORMAL_STIFFNESS,
    PRELOAD,
    TANGENTIAL_STIFFNESS,
    beam_model,
)

#: Elements of the shipped beam; the relative error of f1 is below 1e-5.
N_ELEMENT = 24
#: Number of harmonics including the static one, H + 1, of the beam and of the finer beam.
N_HARMONIC = (8, 12)
NAME, FINER = "beam", "beam_finer"
HEAD = f"""\
# A cantilever of steel, 300 x 20 x 10 mm, between two lines of three frictional contacts on inclined flanks.
# A model of the beam of the virtual test bench, with the parameters of its drawing.
schema = 2
title = "Beam with two contact lines"

[structure]
kind = "plain"
# M, C ({100 * DAMPING_RATIO:g} % Rayleigh), K, the table of degrees of freedom, and the rows named below
"""
FINER_HEAD = f"""\
# The beam of {NAME}.toml with twice the elements and more harmonics.
schema = 2
title = "Beam with two contact lines, finer"

[structure]
kind = "plain"
"""


def write_beam_case(folder: Path | str) -> Path:
    """Write ``beam.toml`` and ``beam.npz``, and both files of the finer beam.

    Parameters
    ----------
    folder
        Existing folder.

    Returns
    -------
    Path of ``beam.toml``.
    """
    folder = Path(folder)
    for name, factor, n_harmonic in zip((NAME, FINER), (1, 2), N_HARMONIC, strict=True):
        model = beam_model(factor * N_ELEMENT, n_harmonic=n_harmonic)
        write_npz(folder / f"{name}.npz", _list_arrays(model), ZIP_DEFLATED)
        (folder / f"{name}.toml").write_text(_format_case(model, name), encoding="utf-8")
    return folder / f"{NAME}.toml"


def _list_arrays(model: Model) -> dict[str, np.ndarray]:
    system = model.system
    arrays: dict[str, np.ndarray] = {
        "M": system.mass,
        "C": system.damping,
        "K": system.stiffness,
        "dof_body": np.array([dof.body for dof in model.dofs]),
        "dof_node": np.array([dof.node for dof in model.dofs]),
        "dof_direction": np.array([dof.direction for dof in model.dofs]),
        "dof_coordinates": np.array([dof.coordinates for dof in model.dofs]),
    }
    arrays |= {name: row for name, row in model.places.items() if _find_node(model, name) is None}
    for line, members in model.lines.items():
        contacts = [model.contact(name) for name in members]
        arrays[f"{line}_normal"] = np.array([contact.normal for contact in contacts])
        arrays[f"{line}_tangent"] = np.array([contact.tangents[0] for contact in contacts])
    return arrays


def _find_node(model: Model, place: str) -> int | None:
    """Node at a place; None if the place lies within an element."""
    row = model.places[place]
    dof = int(np.abs(row).argmax())
    return model.dofs[dof].node if np.abs(row).sum() - 1 < 1e-9 else None


def _format_case(model: Model, file: str) -> str:
    tables = [f'{HEAD if file == NAME else FINER_HEAD}file = "{file}.npz"\n']
    for name in model.places:
        node = _find_node(model, name)
        where = f'row = "{name}"' if node is None else f'body = "beam"\nnode = {node}\ndirection = "z"'
        tables.append(f'[[place]]\nname = "{name}"\n{where}\n')
    motions = [sensor.name for sensor in model.sensors if isinstance(sensor, Sensor)]
    tables += [f'[[sensor]]\nname = "{name}"\nplace = "{name}"\n' for name in motions]
    for sensor in model.sensors:
        if isinstance(sensor, LineSensor):
            misfit = f'line = "{sensor.line}"\ncomponent = "{sensor.component}"'
            tables.append(f'[[sensor]]\nname = "{sensor.name}"\n{misfit}\n')
    for line in model.lines:
        gap = f'gap = ["0 um", "{5e5 * GAP:g} um", "{1e6 * GAP:g} um"]\n' if line == "right" else ""
        tables.append(
            f'[[line]]\nname = "{line}"\nnormal = {{ row = "{line}_normal" }}\ntangent = {{ row = "{line}_tangent" }}\n'
            f"shares = [1, 4, 1] # of the stiffnesses and the preload of the line\n"
            f'normal_stiffness = "{1e-6 * NORMAL_STIFFNESS:g} N/um"\n'
            f'tangential_stiffness = "{1e-6 * TANGENTIAL_STIFFNESS:g} N/um"\n'
            f"friction_coefficient = {FRICTION_COEFFICIENT:g}\n"
            f'preload = "{PRELOAD:g} N"\n{gap}balanced_preload = true\npressed_by = "screw"\n'
        )
    tables.append('[[load]] # 1 N; the level of a test scales it\nplace = "excitation"\n')
    if file == NAME:  # the finer case only provides a structure
        tables.append(
            "[accepted] # prior standard deviations of the values of the drawing, relative\n"
            'kt = "10 %"\nkn = "10 %"\nmu = "10 %"\nzeta = "20 %"\nE = "1 %"\n'
            'bearing = "5 %" # distance of the contacts from the middle of their line\n'
            "\n[numerical_error]\n"
            'frequency = "0.002 %"\ncompliance = "0.1 %"\n'
            'shares = "0 %" # by the drawing, the line has exactly these three contacts\n'
            'model = "0 %" # the virtual bench measures this very structure\n'
            f'refined = ["{FINER}.toml"]\n'
            "\n[effects]\n"
            'without = ["delay"] # the virtual bench reads all channels at once\n'
        )
        tables.append(
            "[sweep] # for stickslip solve and stickslip limits\n"
            'from = "430 Hz"\nto = "500 Hz"\nstep = "2 Hz"\nlevels = [1, 3, 10]\n'
        )
    tables.append(f"[harmonics]\nhighest = {model.n_harmonic - 1}\n")
    return "\n".join(tables)


def main(words: Sequence[str] | None = None) -> None:
    """Write the case and, if requested, a campaign, from the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m study.beam.case", description="The beam of the virtual test bench."
    )
    parser.add_argument("folder", type=Path, help="where the files go; made if it is not there")
    parser.add_argument("--campaign", type=int, metavar="SEED", help="measure a specimen too, into FOLDER/campaign")
    given = parser.parse_args(words)
    given.folder.mkdir(parents=True, exist_ok=True)
    sys.stdout.write(f"{write_beam_case(given.folder)}\n")
    if given.campaign is not None:
        from transient.virtual_bench.hidden_effect import make_campaign

        make_campaign(given.folder / "campaign", seed=given.campaign)
        sys.stdout.write(f"{given.folder / 'campaign'}\n")


if __name__ == "__main__":
    main()
