"""Virtual campaigns on a rig with one hidden effect, by time integration of a separate reduced model.

The specimen is the rig of the case on another mesh, with parameters that deviate from the drawing. Each repeat is a new
set-up: dead weights and frequency have small deviations, and the initial friction forces are random within their
limits.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.rig_case import stored_run, with_tables
from fe.dense_modes import compute_dense_modes
from reduction.joined_bodies import make_jointed_system
from reduction.jointed_system import CubicSpring, FrictionContact, JointedSystem
from reduction.stuck import stuck_stiffness
from study.case.tables import Case
from study.kind.registry import open_case
from study.kind.rig.reduction import RigReduction, reduce_rig
from study.kind.rig.structure import Row, excitation, list_measured_places, make_preloaded_rig, make_suspension
from study.kind.rig.table import RigTable, make_rig_model
from transient.virtual_bench.campaign import (
    FREQUENCY_JITTER,
    HISTORY,
    PARAMETER_DEVIATION,
    PRELOAD_JITTER,
    CampaignLayout,
    CampaignPoints,
    Sweep,
    with_noise,
    write_campaign,
)
from transient.virtual_bench.sweep import VirtualSweepTest

#: Number of modes among which the first one excited by the force is searched: free or rolling bodies have lower modes.
LOWEST = 20
#: Response of an excited mode, as a fraction of the largest response of these modes.
DRIVEN = 0.01
#: Frequencies relative to the stuck bending frequency, and to that of the free configuration.
JOINTED_GRID = (0.975, 0.985, 0.992, 0.997, 1.0, 1.003, 1.01, 1.02)
FREE_GRID = (0.98, 0.99, 0.995, 0.999, 1.001, 1.005, 1.01, 1.02)
#: Level of the free configuration [N]: without contacts the specimen moves a hundred times as far.
FREE_LEVEL = 0.1
LINES = ("left_blade", "left_decoupler", "right_blade", "right_decoupler")
SENSORS = ("tip", "excitation", "slot", "damper_left", "damper_right")


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """Hidden effect of a specimen.

    Parameters
    ----------
    kind
        "nothing", "mass" at the tip, "preload" of the left dead weight, or "cubic" at the tip.
    strength
        Strength of the effect [kg, N, N/m^3].
    """

    kind: str
    strength: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """Rig on a separate mesh, with its parameters as factors on those of the drawing."""

    case: Case[RigTable]
    reduction: RigReduction
    factors: Mapping[str, float]


def meshed(path: Path, size: float, n_mode: int) -> Case[RigTable]:
    """Case of a file with the given size of elements [m] and number of modes of all bodies together."""
    return with_tables(open_case(path).case, mesh={"size": size}, reduction={"modes": n_mode})


def specimen(case: Case[RigTable], random: np.random.Generator) -> Specimen:
    """Make a specimen of the rig of a case.

    Parameters
    ----------
    case
        Case with the drawing.
    random
        Generator of the parameters.
    """
    run = stored_run()
    reduction = reduce_rig(make_rig_model(case), run.store, run.progress)
    factors = {name: 1 + sigma * random.standard_normal() for name, sigma in PARAMETER_DEVIATION.items()}
    return Specimen(case=case, reduction=reduction, factors=factors)


def systems(of: Specimen, effect: HiddenEffect, load: float) -> tuple[JointedSystem, JointedSystem]:
    """Jointed and free specimen of one set-up, with dead weights `load` times those of the drawing."""
    drawn, factors = of.case.structure, of.factors
    contact, weight = drawn.contact, drawn.dead_weight
    left = weight.force + (effect.strength if effect.kind == "preload" else 0.0)
    case = with_tables(
        of.case,
        contact={
            "kt": contact.kt * factors["tangential_stiffness"],
            "kn": contact.kn * factors["normal_stiffness"],
            "mu": contact.mu * factors["friction_coefficient"],
        },
        dead_weight={
            "force": weight.force * load,
            "left": weight.left.model_copy(update={"force": left * load}),
        },
    )
    preloaded = make_preloaded_rig(case, make_rig_model(of.case), of.reduction)
    system = make_jointed_system(
        preloaded.joined,
        preloaded.static_state,
        drawn.damping.ratio * factors["damping_ratio"],
        excitation(of.reduction),
    )
    young, bodies = factors["youngs_modulus"] - 1, preloaded.joined.bodies
    # The damping of the specimen does not depend on its Young's modulus, unlike that of a model.
    # The bench takes the first word of a contact's name as its line.
    joints = [replace(item, name=item.name.replace(".", " ")) for item in system.joints]
    jointed = replace(system, stiffness=system.stiffness + young * bodies, joints=joints)
    free = replace(
        system,
        stiffness=(1 + young) * bodies + make_suspension(of.reduction),
        joints=[],
        static_load=np.zeros(len(bodies)),
    )
    tip = np.flatnonzero(list_measured_places(of.reduction)["tip"])[0]
    if effect.kind == "mass":
        # x, y and z of a boundary node are consecutive.
        mass = np.array(system.mass)
        mass[[tip - 1, tip, tip + 1], [tip - 1, tip, tip + 1]] += effect.strength
        return replace(jointed, mass=mass), replace(free, mass=mass)
    if effect.kind == "cubic":
        spring = CubicSpring(
            name="hidden spring", direction=list_measured_places(of.reduction)["tip"], stiffness=effect.strength
        )
        return replace(jointed, joints=[*jointed.joints, spring]), replace(free, joints=[spring])
    return jointed, free


def sweeps(of: Specimen, effect: HiddenEffect, points: CampaignPoints, random: np.random.Generator) -> Iterator[Sweep]:
    """All sweeps of a campaign, without noise."""
    sensors = {name: row for name, row in list_measured_places(of.reduction).items() if name in SENSORS}
    for repeat in range(1, points.n_repeat + 1):
        load, shift, shift_free = 1 + random.standard_normal(3) * [PRELOAD_JITTER, FREQUENCY_JITTER, FREQUENCY_JITTER]
        jointed, free = systems(of, effect, load)
        for configuration, system, frequencies, factor, levels in (
            ("jointed", jointed, points.frequencies, shift, points.levels),
            ("free", free, points.free_frequencies, shift_free, (FREE_LEVEL,)),
        ):
            bench = VirtualSweepTest(system, sensors)
            up = [float(item * factor) for item in frequencies]
            count = sum(isinstance(joint, FrictionContact) for joint in system.joints)
            for level in levels:
                share = random.uniform(-HISTORY, HISTORY, count) if count else None
                readings = bench.sweep([*up, *reversed(up)], level, share)
                yield Sweep(configuration=configuration, repeat=repeat, level=float(level), readings=readings)


def make_rig_campaign(folder: Path, case: Case[RigTable], *, seed: int, effect: HiddenEffect) -> Specimen:
    """Measure a rig with a hidden effect and write the folder of the campaign.

    Parameters
    ----------
    folder
        Folder for campaign.toml and its tables.
    case
        Case with the drawing of the specimen and its mesh.
    seed
        Seed of parameters, histories, jitter and noise.
    effect
        Hidden effect.
    """
    streams = [np.random.default_rng(item) for item in np.random.SeedSequence(seed).spawn(3)]
    made = specimen(case, streams[0])
    points = rig_points(made, effect)
    measured = [
        replace(sweep, readings=with_noise(sweep.readings, streams[2]))
        for sweep in sweeps(made, effect, points, streams[1])
    ]
    write_campaign(folder, measured, points, CampaignLayout(title="Rig", sensors=SENSORS, lines=LINES, direction="y"))
    return made


def rig_points(of: Specimen, effect: HiddenEffect, n_repeat: int = 3) -> CampaignPoints:
    """Measurement points around the resonances of the specimen, which a test would first search."""
    jointed, free = systems(of, effect, 1.0)
    tip, force = list_measured_places(of.reduction)["tip"], excitation(of.reduction)[1].real
    return CampaignPoints(
        levels=(1.0, 3.0, 5.0, 10.0),
        frequencies=_near(_resonance(jointed, tip, force), JOINTED_GRID),
        free_frequencies=_near(_resonance(free, tip, force), FREE_GRID),
        n_repeat=n_repeat,
    )


def _resonance(system: JointedSystem, tip: Row, force: Row) -> float:
    """Frequency of the first mode in which the force moves the tip, with all contacts stuck [Hz]."""
    modes = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    eigenvalue, shapes = modes.lambda_[:LOWEST], modes.mode_shapes[:, :LOWEST]
    moved = np.abs((tip @ shapes) * (force @ shapes)) / eigenvalue
    return float(np.sqrt(eigenvalue[np.argmax(moved > DRIVEN * moved.max())]) / (2 * np.pi))


def _near(frequency: float, grid: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(frequency * item, 2) for item in grid)
