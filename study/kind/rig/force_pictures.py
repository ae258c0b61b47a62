"""Pictures of a solved rig: forces and states of its contact lines, load cells, and a film of its deflection."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from figure.line_forces import LineForce, LineForces
from figure.line_states import LineStates, StateHistories
from figure.reactions import Reaction, Reactions
from figure.style import choose_evenly
from geometry.errors import MissingSoftware
from geometry.rig import SIDES, mating_pairs
from hbsolve.fourier import samples_from_coefficients
from study.kind.rig.forces import RigForces
from study.kind.rig.model import RigModel
from study.kind.rig.pictures import rig_film
from study.modes.files import write_contents
from study.run_context import RunContext

#: Largest number of curves in a figure of forces; more would hide each other.
MOST_CURVES = 4
N_FRAME = 24
#: Stations of a rig are counted from the end of the damper.
STATION_LABEL = "station, from the damper's end [-]"


def choose_most_loaded(levels: Sequence[float], peaks: Sequence[RigForces]) -> list[int]:
    """Choose some levels, with the highest, and for each the curve whose contacts are closest to gross slip."""
    distinct = np.unique(levels)
    drawn = distinct[choose_evenly(len(distinct), MOST_CURVES)]
    ratio = [max(line.ratio for line in peak.lines.values()) for peak in peaks]
    return [max(np.flatnonzero(np.equal(levels, level)).tolist(), key=lambda one: ratio[one]) for level in drawn]


def draw_forces(
    stem: str,
    title: str,
    friction_coefficient: Mapping[str, float],
    labels: Sequence[str],
    peaks: Sequence[RigForces],
    chosen: Sequence[int],
    run: RunContext,
) -> list[Path]:
    """Write the figures of forces at the highest points of some curves, and of contact states of the last of these.

    Parameters
    ----------
    stem, title
        Stem of the files, and title of the figures.
    friction_coefficient
        Friction coefficient of each pair, by name [-].
    labels, peaks
        Label, and forces at the highest point, of each curve.
    chosen
        Indices of the drawn curves, see `choose_most_loaded`.
    run
        Output folder, store and progress of the run.
    """
    drawn = chosen[-1]
    forces = [
        LineForce(
            name=name, label=labels[one], time=peaks[one].time, tangential=line.force.tangential,
            normal=line.force.normal,
        )
        for name in friction_coefficient
        for one in chosen
        for line in (peaks[one].lines[name],)
    ]  # fmt: skip
    cells = [
        Reaction(name=body, label=labels[one], time=peaks[one].time, upper=pushed[0], lower=pushed[1])
        for body in peaks[0].cells
        for one in chosen
        for pushed in (peaks[one].cells[body],)
    ]
    last = peaks[drawn].lines
    states = [
        [LineStates(name=f"{side}_{other}", states=last[f"{side}_{other}"].status) for side in SIDES]
        for other in ("blade", "decoupler")
    ]
    where = "at the highest point of each curve"
    if len(chosen) < len(peaks):
        where = (
            f"at the highest point of {len(chosen)} of {len(peaks)} curves: of each level that with the largest |T| / N"
        )
    results: dict[str, object] = {
        "line_forces": LineForces(
            forces=forces, friction_coefficient=friction_coefficient, title=f"{title}: contact forces", subtitle=where
        ),
        "load_cells": Reactions(
            reactions=cells, title=f"{title}: forces of the arms on their load cells", subtitle=where
        ),
        "line_states": StateHistories(
            panels=states, title=f"{title}: contact states", subtitle=f"{labels[drawn]}, highest point",
            station_label=STATION_LABEL,
        ),
    }  # fmt: skip
    return run.draw({f"{stem}_{name}": result for name, result in results.items()})


def draw_film(
    stem: str,
    title: str,
    model: RigModel,
    label: str,
    angular_frequency: float,
    displacement: Complex[NDArray[np.complex128], "harmonic node 3"],
    forces: RigForces,
    run: RunContext,
) -> list[Path]:
    """Write the film of a steady state; on a machine that cannot draw, only warn.

    Parameters
    ----------
    stem, title
        Stem of the file, and title of the film.
    model
        Model of the rig.
    label, angular_frequency
        Label of the curve, and angular frequency of the state [rad/s].
    displacement
        Fourier coefficients of the displacement on the nodes of all bodies in their order [m].
    forces
        Forces of the state.
    run
        Output folder, store and progress of the run.
    """
    # Without the mean displacement, which would be enlarged with the vibration.
    moving = displacement.copy()
    moving[0] = 0.0
    status = np.concatenate([forces.lines[name].status for name in mating_pairs(model.rig)])
    drawn = status[:, np.arange(N_FRAME) * status.shape[1] // N_FRAME]
    subtitle = f"{label}, {angular_frequency / (2 * np.pi):.2f} Hz"
    try:
        content = run.step("film of the deflection").run(
            rig_film, model, samples_from_coefficients(moving, N_FRAME), drawn.T.copy(), title, subtitle
        )
    except MissingSoftware as error:
        run.warn(f"there is no film: {error}")
        return []
    return write_contents(run, stem, {"film.gif": content})
