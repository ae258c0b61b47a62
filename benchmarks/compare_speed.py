"""Measure processor time, elapsed time and memory of the command `stickslip compare` on four campaigns.

Each campaign has 4 levels x 40 frequencies x 2 sweeps x 5 repeats x 4 sensors, simulated with the model itself with
random friction histories, jitter of preload and frequency, and 0.5 % noise.

beam      the shipped beam: 48 degrees of freedom, 6 contacts, Rayleigh damping, a finer model
forty     a random chain of 39 degrees of freedom with 6 contacts and non-proportional damping
many      a random chain of 84 degrees of freedom with 28 contacts of one tangent each, as in the paper
coupled   the same chain with two coupled tangents for each contact

Run it with

    python -m benchmarks.compare_speed [beam forty many coupled] [--base CHECKOUT] [--profile FILE]

`--base` also runs the command of another checkout and compares the misfits of all points. Every run starts with an
empty store and with compiled kernels.
"""

import argparse
import csv
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.random_systems import log_uniform, random_springs
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.write_campaign import write_campaign
from correlation.model import LineSensor, Model, Sensor
from correlation.noise.nuisance import count_contact_sliders, make_slider_start
from correlation.prediction import Points, Predictor
from fe.dense_modes import compute_dense_modes
from reduction.file.npz import write_npz
from reduction.jointed_system import Friction, FrictionContact, JointedSystem
from reduction.stuck import stuck_stiffness
from study.beam.case import N_ELEMENT, write_beam_case
from study.beam.model import beam_model

ROOT = Path(__file__).resolve().parents[1]
LEVELS, N_FREQUENCY, N_REPEAT = (1.0, 3.0, 5.0, 10.0), 40, 5
BAND = (0.96, 1.04)
NOISE, PRELOAD_JITTER, FREQUENCY_JITTER = 5e-3, 5e-3, 5e-5
#: Number of masses, contacts and tangents, preload of each contact [N], small enough for slip at the highest level, and
#: seed.
CHAINS = {"forty": (13, 6, 2, 1.0, 1), "many": (28, 28, 1, 0.1, 2), "coupled": (28, 28, 2, 0.1, 2)}
COMMAND = "import sys; from study.cli import main; sys.argv = ['stickslip', *sys.argv[1:]]; sys.exit(main())"


def chain(n_mass: int, contacts: int, tangents: int, preload: float, seed: int, *, dashpot: bool) -> Model:
    """Make a chain of masses with three degrees of freedom each and two or four lines of contacts to the ground.

    Parameters
    ----------
    n_mass, contacts
        Numbers of masses and contacts.
    tangents
        Number of tangents of each contact; two are coupled.
    preload
        Preload of each contact [N].
    seed
        Seed of masses, springs and directions.
    dashpot
        Whether a dashpot at the first mass couples the modes.
    """
    random = np.random.default_rng([20261124, seed])
    stiffness, spring = random_springs(random, n_mass)
    mass = np.diag(np.repeat(log_uniform(random, 0.2, 5.0, n_mass), 3))
    squared, shapes = np.linalg.eigh(np.diag(mass.diagonal() ** -0.5) @ stiffness @ np.diag(mass.diagonal() ** -0.5))
    weighted = np.diag(mass.diagonal() ** 0.5) @ shapes
    damping = weighted * (2 * 0.005 * np.sqrt(squared)) @ weighted.T
    if dashpot:
        damping[0, 0] += 0.02 * np.sqrt(mass[0, 0] * stiffness[0, 0])
    n_line = 4 if contacts >= 8 else 2
    joints, lines = [], {}
    for line in range(n_line):
        members = []
        for number in range(contacts // n_line):
            place = np.zeros((3, 3 * n_mass))
            at = (line * (contacts // n_line) + number) * (n_mass - 1) // contacts
            place[:, 3 * at : 3 * at + 3] = np.linalg.qr(random.normal(size=(3, 3)))[0]
            members.append(
                FrictionContact(
                    name=f"line{line}.{number + 1}", normal=place[0], tangents=place[1 : 1 + tangents],
                    normal_stiffness=0.1 * spring, tangential_stiffness=0.08 * spring, friction_coefficient=0.4,
                    preload=preload, friction=Friction.COULOMB if tangents == 2 else Friction.UNCOUPLED,
                )
            )  # fmt: skip
        joints += members
        lines[f"line{line}"] = tuple(contact.name for contact in members)
    places = {"drive": np.eye(3 * n_mass)[3 * (n_mass // 2)], "end": np.eye(3 * n_mass)[-3]}
    force = np.zeros((2, 3 * n_mass), dtype=np.complex128)
    force[1] = places["drive"]
    static = np.sum([contact.preload * contact.normal for contact in joints], axis=0)
    system = JointedSystem(
        mass=mass, damping=damping, stiffness=stiffness, joints=joints, static_load=static, harmonic_force=force
    )
    sensors = (
        *(Sensor(name=name, row=row) for name, row in places.items()),
        LineSensor(name="line0_T", line="line0", component="tangential"),
        LineSensor(name="line1_N", line="line1", component="normal"),
    )
    return Model(system=system, sensors=sensors, lines=lines, places=places, n_harmonic=8)


def write_chain(model: Model, folder: Path) -> Path:
    """Write the case of a chain."""
    arrays = {"M": model.system.mass, "C": model.system.damping, "K": model.system.stiffness, **model.places}
    text = [
        'schema = 2\ntitle = "Chain with friction"\n[structure]\nkind = "plain"\nfile = "chain.npz"\n',
        *(f'[[place]]\nname = "{name}"\nrow = "{name}"\n' for name in model.places),
        '[[sensor]]\nname = "drive"\nplace = "drive"\n[[sensor]]\nname = "end"\nplace = "end"\n',
        '[[load]]\nplace = "drive"\n[harmonics]\nhighest = 7\n[accepted]\nkt = "10 %"\nmu = "10 %"\n',
    ]
    for name, members in model.lines.items():
        contacts = [model.contact(member) for member in members]
        arrays[f"{name}_normal"] = np.array([contact.normal for contact in contacts])
        one = contacts[0]
        for number in range(len(one.tangents)):
            arrays[f"{name}_{number}"] = np.array([contact.tangents[number] for contact in contacts])
        second = f'second_tangent = {{ row = "{name}_1" }}\n' if len(one.tangents) == 2 else ""
        text.append(
            f'[[line]]\nname = "{name}"\nnormal = {{ row = "{name}_normal" }}\ntangent = {{ row = "{name}_0" }}\n'
            f'{second}normal_stiffness = "{one.normal_stiffness!r} N/m"\n'
            f'tangential_stiffness = "{one.tangential_stiffness!r} N/m"\nfriction = "{one.friction.value}"\n'
            f'friction_coefficient = {one.friction_coefficient}\npreload = "{one.preload} N"\nbalanced_preload = true\n'
        )
    text += [
        f'[[sensor]]\nname = "{sensor.name}"\nline = "{sensor.line}"\ncomponent = "{sensor.component}"\n'
        for sensor in model.sensors
        if isinstance(sensor, LineSensor)
    ]
    write_npz(folder / "chain.npz", arrays)
    (folder / "chain.toml").write_text("\n".join(text), encoding="utf-8")
    return folder / "chain.toml"


def write_measurements(model: Model, names: Sequence[str], folder: Path, seed: int) -> None:
    """Write a campaign simulated with a model, with readings of the named sensors."""
    random = np.random.default_rng([20261124, 7, seed])
    frequency = stuck_resonance(model) * np.linspace(*BAND, N_FREQUENCY)
    sensors = {sensor.name: sensor for sensor in model.sensors}
    rows = [
        (name, harmonic, level, at)
        for name in names
        for harmonic in ((1, 3) if isinstance(sensors[name], Sensor) else (0, 1))
        for level in LEVELS
        for at in frequency.round(4).tolist()
    ]
    points = Points(
        free=np.zeros(len(rows), dtype=np.bool_),
        level=np.array([row[2] for row in rows]),
        frequency=np.array([row[3] for row in rows]),
        sensor=np.array([row[0] for row in rows]),
        harmonic=np.array([row[1] for row in rows]),
    )
    before, tables = None, []
    for repeat in range(1, N_REPEAT + 1):
        moved = model.with_frequency_shift("jointed", FREQUENCY_JITTER * random.standard_normal())
        for group in model.preload_groups:
            by = PRELOAD_JITTER * random.standard_normal()
            for name in group:
                moved = moved.with_preload_ratio(name, 1 + by)
        start = make_slider_start(moved, random.random(count_contact_sliders(model)))
        before = Predictor(points=points, slider=start, sweeps=(1, -1)).predict(moved, before)
        for way, value in zip((1, -1), before.by_sweep, strict=True):
            noise = random.standard_normal((len(rows), 2)) @ [1.0, 1j] / np.sqrt(2)
            size = np.maximum(
                np.abs(value), 1e-3 * np.abs(value).max(where=points.sensor == points.sensor[0], initial=0)
            )
            noisy = value + NOISE * size * np.where(points.harmonic == 0, noise.real, noise)
            tables.append((repeat, way, np.where(points.harmonic == 0, noisy.real, noisy)))
    count, n = len(tables), len(rows)
    number = np.array([names.index(name) for name in points.sensor.tolist()])
    table = Measurement(
        test=np.zeros(count * n), order=np.repeat(np.arange(count), n), repeat=np.repeat([t[0] for t in tables], n),
        sweep=np.repeat([t[1] for t in tables], n), level=np.tile(points.level, count),
        frequency=np.tile(points.frequency, count), sensor=np.tile(number, count),
        harmonic=np.tile(points.harmonic, count), value=np.concatenate([t[2] for t in tables]),
    )  # fmt: skip
    measured = [
        MeasuredSensor(name=name, quantity="displacement", direction="x", place=name)
        if isinstance(sensor := sensors[name], Sensor)
        else MeasuredSensor(name=name, quantity="contact force", line=sensor.line, component=sensor.component)
        for name in names
    ]
    campaign = Campaign(
        title="Virtual campaign", folder=folder, sensors=tuple(measured), tests=(Test(name="stepped"),),
        measurement=table, held_out=HeldOut(levels=(5.0,), repeats=(4, 5)),
    )  # fmt: skip
    write_campaign(campaign, folder)


def stuck_resonance(model: Model) -> float:
    """Lowest natural frequency with all contacts stuck [Hz]."""
    modes = compute_dense_modes(model.system.mass, stuck_stiffness(model.system.stiffness, model.system.joints))
    return float(np.sqrt(modes.lambda_[0]) / (2 * np.pi))


def build(name: str, folder: Path) -> tuple[Path, Path]:
    """Write case and campaign of a benchmark name; returns both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    if name == "beam":
        model, case, names = beam_model(N_ELEMENT), write_beam_case(folder), ("tip", "mid", "left_T", "left_N")
    else:
        model = chain(*CHAINS[name], dashpot=name == "forty")
        case, names = write_chain(model, folder), ("drive", "end", "line0_T", "line1_N")
    write_measurements(model, names, folder / "campaign", 1)
    return case, folder / "campaign"


def run(checkout: Path, case: Path, campaign: Path, out: Path, profile: Path | None = None) -> Mapping[str, float]:
    """Run the command; returns processor and elapsed time [s] and peak memory [MB]."""
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "MKL", "OPENBLAS")}
    # An installed program has its bytecode, so a checkout may write it.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    with tempfile.TemporaryDirectory() as store:
        words = [sys.executable, *(["-m", "cProfile", "-o", str(profile)] if profile else [])]
        script = Path(store) / "command.py"
        script.write_text(COMMAND, encoding="utf-8")
        done = subprocess.run(
            [*words, str(script), "compare", str(case), str(campaign), "--out", str(out), "--cache", store],
            env={**environment, **threads, "PYTHONPATH": str(checkout)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
    elapsed, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(done.stderr)
    print("\n".join(f"    {line}" for line in done.stderr.splitlines() if ": done in" in line))
    spent = sum(getattr(after, kind) - getattr(before, kind) for kind in ("ru_utime", "ru_stime"))
    return {"seconds": spent, "elapsed": elapsed, "memory": after.ru_maxrss / 1024}


def agreement(one: Path, other: Path) -> str:
    """Differences between two tables of all points, in standard deviations of each number."""
    tables = [list(csv.DictReader(next(folder.glob("*_compare.csv")).open())) for folder in (one, other)]
    words = []
    for column in ("standardised_real", "standardised_imag", "whitened_real", "whitened_imag"):
        old, new = (np.array([float(row[column] or "nan") for row in table]) for table in tables)
        rms = [f"{np.sqrt(np.nanmean(values**2)):.4f}" for values in (old, new)]
        words.append(f"{column} {' -> '.join(rms)}, {np.nanmax(np.abs(new - old)):.3f} apart at most")
    return "\n".join(words)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=["beam", "forty", "many", "coupled"])
    parser.add_argument("--base", type=Path, help="another checkout")
    parser.add_argument("--profile", type=Path, help="file for the profile of the last run")
    parser.add_argument("--folder", type=Path, help="where the cases are; made there if they are not")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        for name in given.names:
            folder = (given.folder or Path(temporary)) / name
            campaign = folder / "campaign"
            case = next(iter(sorted(folder.glob("*.toml"))), None) if campaign.is_dir() else None
            case = case or build(name, folder)[0]
            checkouts = {"this": ROOT} if given.base is None else {"base": given.base, "this": ROOT}
            for words, checkout in checkouts.items():
                print(f"{name}, {words}", flush=True)
                spent = run(checkout, case, campaign, folder / words, given.profile)
                print("    {seconds:.1f} s of processor time, {elapsed:.1f} s elapsed, {memory:.0f} MB".format(**spent))
            if given.base is not None:
                print(agreement(folder / "base", folder / "this"))


if __name__ == "__main__":
    main()
