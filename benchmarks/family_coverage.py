"""Coverage of limits: they should contain the families of their own system, and not those of a changed one.

    OMP_NUM_THREADS=1 python -m benchmarks.family_coverage [--systems 1000:5000] [--change preload] [--jitter 0]
        [--scatter 0] [--processes 2] [--output coverage.json]

A campaign is measured on a random system by time integration (`transient.virtual_bench.sweep`), independently of
harmonic balance and limits: random friction histories, up and down sweeps, noise of 0.5 %. Its families are then
compared with the limits of the same system, as in `stickslip compare --limits`. With --change the measured system
differs: "preload" is 40 % lower preload and static load, "kt" tangential stiffnesses times 0.7.

Seeds below 1000 are for development: search, reading and the design of the benchmark were changed with them. The score
is that of the first 100 systems from seed 1000 on, which is the default.

systems        `benchmarks.random_systems`: at most 6 masses; damping ratio of at least 0.5 %, because lower damping
               takes minutes to integrate; 1 to 3 contacts that are closed at rest, each with one tangent, in one line
               (an open gap has branches that no friction history leads to; --gaps keeps open contacts)
levels         the load of the system times 0.3, 1 and 3
frequencies    6, from 3 % below to 3 % above the first driven resonance with the contacts stuck
sensors        displacement of the loaded mass; tangential and normal force of the line, static and dynamic
histories      friction force of each contact at rest between -0.9 and 0.9 of its limit
repeats        2, each swept up and down
noise          0.5 % and a floor of 1e-4 of the largest reading of the sensor
search         population 8, 16 random histories, 10 frequencies, 7 harmonics
patience       90 s of processor time to measure a campaign, most take 15: a motion that does not become periodic takes
               many minutes, and its campaign counts as not measured
stability      a steady state that is left within 30 periods of a small push is not recorded: no test could hold it,
               although a search for steady states finds it
"""

import argparse
import json
import multiprocessing
import time
from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.processor_time import TimeUp, limited
from benchmarks.random_systems import random_problem
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.family.family import measured_families
from correlation.family.verdict import FamilyVerdict
from correlation.model import LineSensor, Model, Sensor
from correlation.noise.nuisance import Budget
from fe.dense_modes import compute_dense_modes
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import Friction, FrictionContact, JointedSystem
from reduction.stuck import stuck_stiffness
from study.compare.families import compare_with_limits, make_family_search, select_families
from study.compare.family_limits import find_family_limits
from study.limits.table import LimitsTable
from transient.equilibrium import equilibrium
from transient.errors import TransientError
from transient.state_transition import make_modal_structure
from transient.virtual_bench.sweep import VirtualSweepTest

MOST_MASSES, MOST_CONTACTS = 6, 3
LEAST_DAMPING = 0.005
LEVELS = (0.3, 1.0, 3.0)
SPAN, N_FREQUENCY = 0.03, 6
N_REPEAT, HISTORY = 2, 0.9
NOISE, FLOOR = 0.005, 1e-4
HARMONICS = 8
#: Time steps per period: the force of a contact in full slip reverses within a hundredth of a period. With half as many
#: steps, mean forces were wrong by ten times the noise.
STEPS_PER_PERIOD = 1024
FREQUENCIES = 10
TABLE = LimitsTable(population=8, samples=16)
#: Numerical error between time integration and harmonic balance; both use the same matrices, so no mesh differs.
BUDGET = Budget(frequency=5e-5, compliance=0.0, shares=0.0)
#: Largest processor time to measure a campaign [s].
PATIENCE = 90.0
#: Periods of the stability test after a push.
N_PUSH = 30
PRELOAD_JITTER, FREQUENCY_JITTER = 0.01, 3e-4


def random_model(seed: int, *, gaps: bool = False) -> Model | None:
    """Random system as a model with sensors and a line.

    None if it has too many masses, too many or no contacts, too little damping or a contact that is open at rest.
    """
    problem = random_problem(seed)
    contacts = [
        item
        for item, kind in zip(problem.system.joints, problem.kinds, strict=True)
        if isinstance(item, FrictionContact) and (gaps or kind != "gap")
    ]
    if problem.system.n_dof > 3 * MOST_MASSES or not 1 <= len(contacts) <= MOST_CONTACTS:
        return None
    names = [f"a {number}" for number in range(len(contacts))]
    joints = [
        replace(item, name=name, tangents=item.tangents[:1], friction=Friction.UNCOUPLED)
        for item, name in zip(contacts, names, strict=True)
    ]
    system = replace(problem.system, joints=joints)
    if damping_ratio(system) < LEAST_DAMPING or not (gaps or closed_at_rest(system)):
        return None
    loaded = int(np.abs(system.dynamic[1]).argmax())
    sensor = Sensor(name="near", row=np.eye(system.n_dof)[loaded])
    forces = [LineSensor(name=f"a_{what[0]}", line="a", component=what) for what in ("tangential", "normal")]
    return Model(system=system, sensors=(sensor, *forces), lines={"a": tuple(names)}, n_harmonic=HARMONICS)


def damping_ratio(system: JointedSystem) -> float:
    """Smallest modal damping ratio without contacts [-]."""
    modes = compute_dense_modes(system.mass, system.stiffness)
    damping = np.einsum("im,ij,jm->m", modes.mode_shapes, system.damping, modes.mode_shapes)
    return float((damping / (2 * np.sqrt(modes.lambda_))).min())


def closed_at_rest(system: JointedSystem) -> bool:
    """Whether the static load leaves all contacts closed."""
    rest = equilibrium(make_modal_structure(system)).displacement
    return all(
        item.preload + item.normal_stiffness * (float(item.normal @ rest) - item.gap) > 0
        for item in list_friction_contacts(system.joints)
    )


def frequencies(model: Model) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Frequencies around the first resonance that the force excites, with all contacts closed at rest stuck [Hz]."""
    system = model.system
    modes = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    moved = np.abs(modes.mode_shapes.T @ system.dynamic[1]) ** 2 / modes.lambda_
    first = int(np.argmax(moved > 0.1 * moved.max()))
    resonance = float(np.sqrt(modes.lambda_[first]) / (2 * np.pi))
    return np.asarray(resonance * np.linspace(1 - SPAN, 1 + SPAN, N_FREQUENCY))


def changed(system: JointedSystem, change: str) -> JointedSystem:
    """Measured system with the given change of the model's system."""
    if change == "kt":
        joints = [item.with_values({"tangential_stiffness": 0.7 * item.tangential_stiffness}) for item in system.joints]
        return replace(system, joints=joints)
    return pressed(system, 0.6) if change == "preload" else system


def pressed(system: JointedSystem, ratio: float) -> JointedSystem:
    """System with preloads and static load multiplied by a ratio."""
    joints = [item.with_values({"preload": ratio * item.preload}) for item in system.joints]
    return replace(system, joints=joints, static_load=ratio * system.static)


def measure(model: Model, random: np.random.Generator, change: str, jitter: float, scatter: float = 0.0) -> Campaign:
    """Measure a campaign on the system of a model by time integration."""
    rows = {item.name: item.row for item in model.sensors if isinstance(item, Sensor)}
    place = frequencies(model)
    both = [*place, *reversed(place)]
    records: list[tuple[float, ...]] = []
    values: list[complex] = []
    for repeat in range(N_REPEAT):
        load, shift = 1 + jitter * random.standard_normal(2) * [PRELOAD_JITTER, FREQUENCY_JITTER]
        own = replace(model, system=changed(model.system, change))
        for name in own.preloads:
            own = own.with_preload_ratio(name, float(load))
        bench = VirtualSweepTest(own.system, rows, STEPS_PER_PERIOD)
        for level in LEVELS:
            share = random.uniform(-HISTORY, HISTORY, len(model.system.joints))
            force = level * (1 + scatter * random.standard_normal(len(both))) if scatter else np.full(len(both), level)
            seen = bench.sweep([float(item * shift) for item in both], force.tolist(), share, n_stability_period=N_PUSH)
            for number, frequency in enumerate(both):
                if not seen.periodic[number]:
                    continue
                way = 1 if number < len(place) else -1
                for sensor, value in enumerate([*seen.motion[number, :, 0], *seen.force[number, :, 1]]):
                    records.append((repeat + 1, way, level, frequency, sensor, 1, force[number]))
                    values.append(complex(value))
                for sensor, value in enumerate(seen.force[number, :, 0], start=len(rows)):
                    records.append((repeat + 1, way, level, frequency, sensor, 0, force[number]))
                    values.append(complex(value.real))
    if not records:
        raise TransientError("no motion repeats itself: nothing can be measured")
    return campaign(model, np.array(records), np.array(values), random)


def campaign(model: Model, records: Any, values: Any, random: np.random.Generator) -> Campaign:
    """Campaign of readings with added noise; without a column of forces, the forces are the levels."""
    repeat, sweep, level, frequency, sensor, harmonic = records.T[:6]
    force = records.T[6] if records.shape[1] > 6 else level
    n = len(values)
    floor = np.array([FLOOR * np.abs(values[sensor == item]).max() for item in range(int(sensor.max()) + 1)])
    zeta = (random.standard_normal((2, n)) + 1j * random.standard_normal((2, n))) / np.sqrt(2)
    value = values * (1 + NOISE * np.where(harmonic > 0, zeta[0], 0)) + floor[sensor.astype(int)] * zeta[1]
    value = np.where(harmonic > 0, value, value.real)
    sensors = tuple(
        MeasuredSensor(name=item.name, quantity="displacement", direction="x", place=item.name)
        if isinstance(item, Sensor)
        else MeasuredSensor(name=item.name, quantity="contact force", line=item.line, component=item.component)
        for item in model.sensors
    )
    return Campaign(
        title="random system", folder=Path(), sensors=sensors, tests=(Test(name="stepped"),),
        measurement=Measurement(
            test=np.zeros(n), order=np.arange(n), repeat=repeat, sweep=sweep, level=level, frequency=frequency,
            sensor=sensor, harmonic=harmonic, value=value, force=force,
        ),
        held_out=HeldOut(),
    )  # fmt: skip


def verdicts_of(model: Model, measured: Campaign, budget: Budget = BUDGET) -> tuple[FamilyVerdict, ...]:
    """Verdicts on the families of a campaign, as in `stickslip compare --limits`."""
    families = measured_families(measured)
    chosen, _ = select_families(model, measured, families)
    search = make_family_search(model, budget, measured, chosen, TABLE, None, most=FREQUENCIES, fewest=FREQUENCIES)
    search = search.with_numeric_box()
    limits = find_family_limits.compute(search)
    return compare_with_limits(measured, families, chosen, limits, budget).verdicts


def run(job: tuple[int, str, float, float, bool]) -> Mapping[str, Any]:
    """Result of one system."""
    seed, change, jitter, scatter, gaps = job
    begin = time.process_time()
    model = random_model(seed, gaps=gaps)
    if model is None:
        return {"seed": seed}
    try:
        with limited(PATIENCE):
            measured = measure(model, np.random.default_rng([20261124, seed]), change, jitter, scatter)
        verdicts = verdicts_of(model, measured)
    except (TransientError, TimeUp, ValueError) as error:
        return {"seed": seed, "error": f"{type(error).__name__}: {error}"}
    rows = [
        {
            "sensor": item.family.sensor, "harmonic": item.family.harmonic, "level": item.family.level,
            "coverage": item.coverage, "tightness": item.tightness, "leaves": item.leaves_band,
            "n_outside": len(item.departures), "n": item.n_compared,
            "deviations": max([one.deviations for one in item.departures], default=0.0),
            "worst": max([one.distance / max(abs(one.limit), 1e-300) for one in item.departures], default=0.0),
        }
        for item in verdicts
    ]  # fmt: skip
    return {"seed": seed, "rows": rows, "seconds": time.process_time() - begin}


def summarise(results: list[Mapping[str, Any]]) -> None:
    """Print failures, coverage by level, and campaigns whose families leave their limits."""
    done = [item for item in results if "rows" in item]
    failed = [item for item in results if "error" in item]
    print(f"{len(done)} campaigns, {len(failed)} could not be measured or compared")
    for item in failed:
        print(f"  seed {item['seed']}: {item['error'][:150]}")
    for level in LEVELS:
        rows = [row for item in done for row in item["rows"] if row["level"] == level and row["n"]]
        count = max(sum(row["n"] for row in rows), 1)
        inside = sum(row["coverage"] * row["n"] for row in rows) / count
        print(f"level {level:g}: coverage {inside:.3%} of {count} readings")
    claims = [item for item in done if any(row["leaves"] for row in item["rows"])]
    print(f"{len(claims)} of {len(done)} campaigns are said to leave their limits")
    for item in claims:
        worst = max(item["rows"], key=lambda row: row["deviations"])
        print(
            f"  seed {item['seed']}: {worst['sensor']} {worst['harmonic']} level {worst['level']:g}: "
            f"{worst['n_outside']} of {worst['n']}, {worst['deviations']:.1f} deviations, {worst['worst']:.2%}"
        )
    print(f"{sum(item['seconds'] for item in done) / max(len(done), 1):.1f} s of processor time per campaign")


def main() -> None:
    """Run the systems and print the summary."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--systems", default="1000:5000", help="seeds, first:last+1; not all are of use")
    words.add_argument("--most", type=int, default=100, help="campaigns at most")
    words.add_argument("--change", choices=["none", "preload", "kt"], default="none")
    words.add_argument("--gaps", action="store_true", help="with contacts that are open at rest")
    words.add_argument(
        "--jitter",
        type=float,
        default=0.0,
        help="of preload (not of static loads) and frequency, in those of the bench",
    )
    words.add_argument("--scatter", type=float, default=0.0, help="of the force of each point, which is measured [-]")
    words.add_argument("--processes", type=int, default=1)
    words.add_argument("--output", type=Path, help="results as they come; campaigns that it has are not run again")
    asked = words.parse_args()
    first, last = map(int, asked.systems.split(":"))
    usable = (seed for seed in range(first, last) if random_model(seed, gaps=asked.gaps) is not None)
    seeds = list(islice(usable, asked.most))
    results: list[Mapping[str, Any]] = []
    if asked.output and asked.output.exists():
        results = [item for item in json.loads(asked.output.read_text()) if item["seed"] in seeds]
    done = {item["seed"] for item in results}
    jobs = [(seed, asked.change, asked.jitter, asked.scatter, asked.gaps) for seed in seeds if seed not in done]
    with multiprocessing.get_context("spawn").Pool(asked.processes) as pool:
        for result in pool.imap_unordered(run, jobs):
            results.append(result)
            if asked.output:
                asked.output.write_text(json.dumps(results))
    summarise(results)


if __name__ == "__main__":
    main()
