"""From universal files to estimates: a virtual test is saved as UFF, drafted as a campaign, compared with a model.

python examples/campaign_from_uff.py [FOLDER]     # writes test files, manifest and the page of the comparison to FOLDER
"""

import sys
import tomllib
from pathlib import Path

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from correlation.campaign.read_campaign import read_campaign
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from study import cli
from study.beam.case import write_beam_case
from study.beam.model import beam_model
from transient.virtual_bench.beam import BeamParameters, free_beam, jointed_beam, reduced_beam
from transient.virtual_bench.campaign import scaled
from transient.virtual_bench.sweep import VirtualSweepTest

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "from_uff")
measured, random = folder / "measured", np.random.default_rng(27)
measured.mkdir(parents=True, exist_ok=True)
case, drawing = write_beam_case(folder), beam_model(24)

# The specimen differs from the drawing: contacts 15 % softer. It is integrated in time, not balanced by harmonics.
beam, parameters = reduced_beam(), scaled(BeamParameters(), tangential_stiffness=0.85)
places = {"tip": 24, "mid": 8}  # nodes of the sensors
nodes = {dof.node: np.array(dof.coordinates) for dof in drawing.dofs if dof.node in places.values()}
shaker = Point(node=1, direction="+z", name="shaker")


def save(name: str, abscissa: Column, columns: list[Column]) -> None:
    """Write one universal file with binary values and the coordinates of the sensors."""
    data = MeasuredFile(path=measured / name, format="uff", title="Beam", columns=(abscissa, *columns), nodes=nodes)
    write_uff(data, measured / name, binary=True)


def response(values: NDArray[np.complex128], place: str, unit: str, function: str, abscissa: str) -> Column:
    """A channel with 0.2 % noise."""
    noise = 0.002 * random.normal(size=(2, len(values))) * np.std(values)
    noisy = values + noise[0] + (1j * noise[1] if np.iscomplexobj(values) else 0.0)
    point = Point(node=places[place], direction="+z")
    return Column(
        name=place, values=noisy, unit=unit, abscissa=abscissa, function=function, response=point, reference=shaker
    )


# Stepped sines up and down at three levels, each measured twice: complex spectra of motion and force.
frequencies = np.linspace(440.0, 500.0, 13)
bench = VirtualSweepTest(jointed_beam(beam, parameters), {place: beam.places[place] for place in places})
way = np.concatenate([frequencies, frequencies[-2::-1]])
for level in (1.0, 3.0, 10.0):
    motion = bench.sweep(way.tolist(), level).motion[:, :, 0]
    axis = Column(name="frequency", values=way, unit="Hz")
    force = Column(name="force", values=level * np.ones(len(way), complex), unit="N", abscissa="frequency",
                   function="spectrum", response=shaker)  # fmt: skip
    for repeat in (1, 2):
        sensors = [response(motion[:, at], place, "m", "spectrum", "frequency") for at, place in enumerate(places)]
        save(f"sweep_{level:g}N_{repeat}.uff", axis, [force, *sensors])

# Frequency responses of the free beam with their coherence.
system, line = free_beam(beam, parameters), np.linspace(50.0, 500.0, 901)
omega = 2 * np.pi * line
impedance = [system.stiffness - w**2 * system.mass + 1j * w * system.damping for w in omega]
moved = [np.linalg.solve(matrix, system.dynamic[1]) for matrix in impedance]
responses = [response(np.array(moved) @ beam.places[p], p, "m/N", "frequency response", "frequency") for p in places]
coherences = [response(1.0 - 0.0 * line, p, "", "coherence", "frequency") for p in places]
save("free_beam.uff", Column(name="frequency", values=line, unit="Hz"), [*responses, *coherences])

# A decay of the free beam after a blow at its tip, in its first two modes.
squared, shapes = scipy.linalg.eigh(system.stiffness, system.mass, subset_by_index=[0, 1])
rate = np.einsum("rm,rs,sm->m", shapes, system.damping, shapes) / 2
time = np.arange(8192) / 4096
decays = 0.1 * (beam.places["tip"] @ shapes) / np.sqrt(squared) * np.exp(-np.outer(time, rate))
modal = decays * np.sin(np.outer(time, np.sqrt(squared - rate**2)))
ring_down = response(modal @ (beam.places["tip"] @ shapes), "tip", "m", "time", "time")
save("free_decay.uff", Column(name="time", values=time, unit="s"), [ring_down])

assert cli.main(["campaign", "new", str(measured), "--yes", "--force", "--quiet"]) == 0
manifest = tomllib.loads((measured / "campaign.toml").read_text())
assert [len(manifest[kind]) for kind in ("run", "frf", "ring_down")] == [6, 1, 1]
campaign = read_campaign(measured)
assert campaign.levels.tolist() == [1.0, 3.0, 10.0]
assert set(campaign.measurement.repeat.tolist()) == {1, 2}
for name in ("compared", "estimated"):
    assert cli.main(["compare", str(case), str(measured), "--out", str(folder / name), "--quiet"]) == 0
    if name == "compared":  # then the stiffness that the resonance says is written into the case
        assert cli.main(["estimate", str(case), str(measured), "--write", "--quiet"]) == 0
kt = tomllib.loads(case.read_text())["calibrated"]["kt"]
assert abs(kt / 0.85 - 1) < 0.015  # the interval of the estimate
