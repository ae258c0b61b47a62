"""Measured families over response and force limits of the shipped rig, in the form of figures 17 and 18 of the paper.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_families [--size MM] [--modes N] [--repeats N] [--frequencies N]
        [--softer 1.0] [--folder FOLDER]

The campaign is virtual: the model of the rig itself (`--softer` scales the tangential stiffness of the measured one),
initial sliders from friction histories under the dead weights, sweeps up and down, noise of 0.5 %. Measured are the tip
and the forces of both contact lines of the blade. Figures and the verdict go to the folder.
"""

import argparse
import os
from dataclasses import replace
from pathlib import Path
from time import process_time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy reads them

import numpy as np  # noqa: E402

from benchmarks.family_coverage import campaign  # noqa: E402
from benchmarks.rig_case import stored_run, with_tables  # noqa: E402
from correlation.campaign.measurement import Campaign  # noqa: E402
from correlation.model import LineSensor, Model, Sensor  # noqa: E402
from correlation.prediction import Points, Predictor  # noqa: E402
from fe.dense_modes import compute_dense_modes  # noqa: E402
from reduction.stuck import stuck_stiffness  # noqa: E402
from study.case.setup import read_case  # noqa: E402
from study.compare.families import compare_families  # noqa: E402
from study.compare.family_report import format_family_report  # noqa: E402
from study.kind.registry import open_case  # noqa: E402
from study.limits.table import LimitsTable  # noqa: E402
from study.shipped_cases import RIG  # noqa: E402

LEVELS = (1.0, 3.0, 5.0, 10.0)
LINES = ("left_blade", "right_blade")
#: Measured frequency range relative to the stuck resonance.
BAND = (0.955, 1.015)


def observed(model: Model) -> Model:
    """Model with the tip and the forces of the blade's lines as sensors."""
    tip = next(item for item in model.sensors if isinstance(item, Sensor))
    forces = [
        LineSensor(name=f"{line}_{component[0].upper()}", line=line, component=component)
        for line in LINES
        for component in ("tangential", "normal")
    ]
    return replace(model, sensors=(tip, *forces))


def resonance(model: Model) -> float:
    """First resonance of the tip with all contacts stuck [Hz]."""
    system, tip = model.system, model.sensors[0]
    assert isinstance(tip, Sensor)
    modes = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    moved = np.abs((tip.row @ modes.mode_shapes) * (system.dynamic[1] @ modes.mode_shapes)) / modes.lambda_
    # Free or rolling bodies have lower modes, which the force hardly excites.
    first = int(np.argmax(moved > 0.1 * moved.max()))
    return float(np.sqrt(modes.lambda_[first]) / (2 * np.pi))


def measure(model: Model, sliders: list[np.ndarray], frequency: np.ndarray, seed: int) -> Campaign:
    """Measure a campaign; each repeat starts every level with the sliders of its own friction history."""
    keys = [
        (level, f, number, harmonic)
        for level in LEVELS
        for f in frequency
        for number, sensor in enumerate(model.sensors)
        for harmonic in ((1,) if isinstance(sensor, Sensor) else (0, 1))
    ]
    level, f, number, harmonic = np.array(keys).T
    names = np.array([item.name for item in model.sensors])[number.astype(int)]
    points = Points(
        free=np.zeros(len(keys), dtype=bool), level=level, frequency=f, sensor=names, harmonic=harmonic.astype(int)
    )
    records, values = [], []
    for repeat, start in enumerate(sliders, start=1):
        seen = Predictor(points=points, slider=lambda _, w=start: w, sweeps=(1, -1)).predict(model)
        for way, value in zip((1, -1), seen.by_sweep, strict=True):
            there = np.isfinite(value)
            one = np.ones(int(there.sum()))
            columns = (repeat * one, way * one, *(column[there] for column in (level, f, number, harmonic)))
            records.append(np.column_stack(columns))
            values.append(value[there])
    record, value = np.vstack(records), np.concatenate(values)
    # In the order of the runs: one level up and down, then the next level.
    order = np.lexsort((-record[:, 1], record[:, 2], record[:, 0]))
    return campaign(model, record[order], value[order], np.random.default_rng(seed))


def main() -> None:
    """Print the verdict and write the figures."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--size", type=float, default=5.0, help="of the elements [mm]")
    words.add_argument("--modes", type=int, default=60)
    words.add_argument("--repeats", type=int, default=5)
    words.add_argument("--frequencies", type=int, default=24)
    words.add_argument("--population", type=int, default=8)
    words.add_argument("--samples", type=int, default=20)
    words.add_argument("--softer", type=float, default=1.0, help="factor on kt of the measured rig")
    words.add_argument("--folder", type=Path, default=Path("build/rig_families"))
    asked = words.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    opened = open_case(RIG)
    case = with_tables(opened.case, mesh={"size": 1e-3 * asked.size}, reduction={"modes": asked.modes})
    read = read_case(replace(opened, case=case), run=stored_run())
    model = observed(read.model)
    specimen = model.with_joints(
        {
            joint.name: {"tangential_stiffness": asked.softer * joint.tangential_stiffness}
            for joint in model.system.joints
        }
    )
    assert read.structure.histories is not None
    sliders = read.structure.histories(asked.repeats + 1, 7)[1:]
    frequency = resonance(model) * np.linspace(*BAND, asked.frequencies)
    begin = process_time()
    measured = measure(specimen, sliders, frequency, seed=27)
    print(f"{len(measured.measurement)} readings in {process_time() - begin:.0f} s of processor time", flush=True)
    comparison = compare_families(
        model, read.setup.complete_budget, measured, LimitsTable(population=asked.population, samples=asked.samples),
        read.structure, replace(stored_run(), output=asked.folder), title="Rig", stem="rig",
    )  # fmt: skip
    text = "\n".join(format_family_report(comparison))
    (asked.folder / "verdict.txt").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
