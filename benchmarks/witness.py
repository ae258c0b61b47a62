"""Compare harmonic balance with time integration on nine small systems, a jammed wedge and the reduced blade.

    OMP_NUM_THREADS=1 python benchmarks/witness.py [--systems NAME ...] [--output witness.json]

Curve: points along a branch through resonance, including its peak. Time integration starts on the orbit from harmonic
balance and continues until the motion is periodic; it would leave a wrong orbit. Because sticking sliders keep their
positions, harmonic balance is then solved again with the sliders of the integration.

Histories: time integration starts at rest with random sliders, for each of three levels at two frequencies; harmonic
balance gets only the sliders at the start of the steady period.

The spread is the largest difference between two histories at one frequency and level. Harmonics are added until the
fundamental changes by less than 0.05 %. Compared are the amplitude of the fundamental and its complex value, which
includes the phase. A motion that does not repeat with the excitation is reported and not compared.
"""

import argparse
import importlib.util
import json
import sys
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.response import frequency_response
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import NoSteadyState
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem, along
from transient.equilibrium import equilibrium
from transient.errors import TransientError
from transient.state import TransientState, start_from
from transient.steady import SteadyMotion, steady_motion

TESTS = Path(__file__).parents[1] / "tests" / "physics" / "conftest.py"
N_POINT = 20
H, MOST_H = 7, 63
#: Largest relative change of the fundamental by the last doubling of H; a tenth of the tolerance of the comparison.
CONVERGED = 5e-4
SEED = 20261121
BLADE, JAMMED = "blade", "jammed wedge"


@dataclass
class Outcome:
    """Results of one system; errors are relative."""

    system: str
    damping_ratio: float
    kind: str
    n_point: int = 0
    worst: float = 0.0
    median: float = 0.0
    worst_complex: float = 0.0
    peak: float = float("nan")
    spread: float = float("nan")
    harmonics: int = 0
    failed: list[str] = field(default_factory=list)
    points: list[dict[str, Any]] = field(default_factory=list)
    seconds: float = 0.0


def main() -> None:
    witnessed = fixtures()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--systems", nargs="*", default=[*witnessed.WITNESSED, JAMMED, BLADE])
    parser.add_argument("--output", type=Path)
    arguments = parser.parse_args()
    print(f"{'system':20s}{'zeta':>7s} {'what':10s}{'points':>7s}{'worst':>10s}{'median':>10s}{'with phase':>11s}"
          f"{'peak':>10s}{'spread':>9s}{'H':>4s}{'not compared':>14s}{'s':>7s}", flush=True)  # fmt: skip
    outcomes = []
    for name in arguments.systems:
        if name == JAMMED:
            # The friction coefficient exceeds the tangent of the wedge angle: the wedge stays where its history put it.
            case, peak = witnessed.wedge_damper(friction_coefficient=0.6), 2 * np.pi * 280.0
            outcomes.append(show(histories(name, replace(case, histories=(0.1, 0.2, 0.3)), peak)))
            continue
        case = blade(witnessed) if name == BLADE else witnessed.WITNESSED[name]()
        outcomes.append(show(curve(name, case)))
        if case.histories:
            outcomes.append(show(histories(name, case)))
        if arguments.output:
            arguments.output.write_text(json.dumps([asdict(item) for item in outcomes], indent=1), encoding="utf-8")


def curve(name: str, case: Any) -> Outcome:
    """Compare points along a branch at level 1."""
    outcome, begin = Outcome(name, case.damping_ratio, "curve"), time.perf_counter()
    balance = HarmonicBalance(system=case.system, n_harmonic=H + 1)
    branch = frequency_response(balance, case.first, case.last)
    if branch.stop_reason is not StopReason.REACHED:
        outcome.failed.append(f"branch: {branch.stop_message}")
    amplitude = branch.amplitude(case.row)
    peak = int(amplitude.argmax())
    best = []
    for point in sorted({peak, *spread(branch, amplitude)}):
        omega = float(branch.angular_frequency[point])
        label = f"{omega / 2 / np.pi:.6g} Hz"
        if turned(branch, point, case):
            outcome.failed.append(f"{label}: between the folds, unstable")
            continue
        # A branch stores coefficients only; a solve from them takes one iteration and gives the sliders.
        result = steady_state(balance, omega, start=branch.start(balance, point))
        state, harmonics = converged(case.system, omega, 1.0, result.initial_slider, result)
        motion = integrated(
            case.system, omega, 1.0, start_from(case.system, omega, state.coefficients, state.periodic_slider)
        )
        both = compare(outcome, label, case, omega, 1.0, motion, state, harmonics)
        if both is not None:
            best.append(both)
    if best:
        top = np.array(best).max(axis=0)
        outcome.peak = float(abs(top[0] / top[1] - 1))
    outcome.seconds = time.perf_counter() - begin
    return outcome


def histories(name: str, case: Any, peak: float | None = None) -> Outcome:
    """Compare twelve points: three levels, two frequencies at and above the resonance, two histories each."""
    outcome, begin = Outcome(name, case.damping_ratio, "histories"), time.perf_counter()
    random = np.random.default_rng(SEED)
    if peak is None:
        balance = HarmonicBalance(system=case.system, n_harmonic=H + 1)
        branch = frequency_response(balance, case.first, case.last)
        peak = float(branch.angular_frequency[branch.amplitude(case.row).argmax()])
    for level in case.histories:
        for share in (1.0, 1.03):
            for history in range(2):
                omega = share * peak
                label = f"{omega / 2 / np.pi:.6g} Hz, level {level:g}, history {history + 1}"
                rest = equilibrium(case.system)
                slider = rest.slider + random.uniform(-1, 1, len(rest.slider)) * reach(case.system, rest)
                start = TransientState(displacement=rest.displacement, velocity=rest.velocity, slider=slider)
                motion = integrated(case.system, omega, level, start)
                compare(outcome, label, case, omega, level, motion)
    outcome.seconds = time.perf_counter() - begin
    outcome.spread = max((max(group) / min(group) - 1 for group in groups(outcome).values()), default=float("nan"))
    return outcome


def groups(outcome: Outcome) -> dict[tuple[float, float], list[float]]:
    """Amplitudes of the histories by frequency and level."""
    result: dict[tuple[float, float], list[float]] = {}
    for point in outcome.points:
        result.setdefault((point["omega"], point["level"]), []).append(point["integration"])
    return result


def compare(
    outcome: Outcome,
    label: str,
    case: Any,
    omega: float,
    level: float,
    motion: SteadyMotion | str,
    start: SteadyState | None = None,
    harmonics: int = H,
) -> tuple[float, float] | None:
    """Compare one point; returns the amplitudes by harmonic balance and by integration, or None if it is excluded."""
    if isinstance(motion, str) or not motion.periodic:
        outcome.failed.append(f"{label}: {motion if isinstance(motion, str) else motion.message}")
        return None
    try:
        # Start with half of the harmonics, so that convergence is checked again.
        state, harmonics = converged(case.system, omega, level, motion.start.slider, start, max(H, harmonics // 2))
    except NoSteadyState as error:
        outcome.failed.append(f"{label}: {error}")
        return None
    mine, witness = state.coefficients[1] @ case.row, motion.coefficients(2)[1] @ case.row
    point = {
        "omega": omega, "level": level, "balance": abs(mine), "integration": abs(witness), "H": harmonics,
        "error": abs(abs(mine) / abs(witness) - 1), "complex_error": abs(mine / witness - 1),
        "step_error": motion.step_error, "steps": motion.steps_per_period, "periods": motion.n_period,
        "distance": motion.distance, "moving": moving(motion), "label": label,
    }  # fmt: skip
    if start is not None:
        # Relative change of the response by the slider history alone.
        point["moved_by_sliders"] = abs(state.coefficients[1] @ case.row / (start.coefficients[1] @ case.row) - 1)
    outcome.points.append(point)
    errors = np.array([item["error"] for item in outcome.points])
    outcome.n_point, outcome.worst, outcome.median = len(errors), float(errors.max()), float(np.median(errors))
    outcome.worst_complex = max(item["complex_error"] for item in outcome.points)
    outcome.harmonics = max(outcome.harmonics, harmonics)
    return float(abs(mine)), float(abs(witness))


def moving(motion: SteadyMotion) -> float:
    """Fraction of the period in which sliders move, mean over the sliders [-]."""
    slider = motion.slider
    if not len(slider):
        return 0.0
    step = np.abs(np.roll(slider, -1, axis=1) - slider)
    return float((step > 1e-9 * np.abs(motion.displacement).max()).mean())


def converged(
    system: JointedSystem,
    omega: float,
    level: float,
    slider: NDArray[np.float64],
    start: SteadyState | None,
    harmonics: int = H,
) -> tuple[SteadyState, int]:
    """Steady state after convergence with the number of harmonics, and this number."""
    before: SteadyState | None = None
    while True:
        balance = HarmonicBalance(system=system, n_harmonic=harmonics + 1, level=level)
        guess = None if start is None else padded(start, harmonics)
        state = steady_state(balance, omega, start=guess, slider=slider)
        if before is not None:
            old, new = before.coefficients[1], state.coefficients[1]
            if np.linalg.norm(new - old) <= CONVERGED * np.linalg.norm(new) or 2 * harmonics + 1 > MOST_H:
                return state, harmonics
        before = start = state
        harmonics = 2 * harmonics + 1


def padded(state: SteadyState, harmonics: int) -> NDArray[np.float64]:
    """Motion of a state, padded or truncated to a number of harmonics."""
    motion = np.zeros((len(state.motion), 2 * harmonics + 1))
    kept = min(motion.shape[1], state.motion.shape[1])
    motion[:, :kept] = state.motion[:, :kept]
    return motion


def integrated(system: JointedSystem, omega: float, level: float, start: TransientState) -> SteadyMotion | str:
    try:
        return steady_motion(
            system, omega, start, level, tolerance=2e-5, step_tolerance=3e-4, steps_per_period=512,
            max_steps_per_period=8192, max_period=4000,
        )  # fmt: skip
    except TransientError as error:
        return str(error)


def spread(branch: ResponseBranch, amplitude: NDArray[np.float64]) -> list[int]:
    """Points at equal distances along the curve, with both axes scaled to unit length."""
    omega = branch.angular_frequency
    step = np.hypot(np.diff(omega) / np.ptp(omega), np.diff(amplitude) / np.ptp(amplitude))
    way = np.concatenate([[0.0], np.cumsum(step)])
    return [int(np.abs(way - at).argmin()) for at in np.linspace(0, way[-1], N_POINT)]


def turned(branch: ResponseBranch, point: int, case: Any) -> bool:
    """Whether the branch runs backwards in frequency at a point, between two folds."""
    ahead = np.gradient(branch.angular_frequency)[point]
    return bool(ahead * (case.last - case.first) < 0)


def reach(system: JointedSystem, rest: TransientState) -> NDArray[np.float64]:
    """Largest distance of each slider from rest within Coulomb's limit [m]."""
    values: list[float] = []
    for joint in system.joints:
        if isinstance(joint, JenkinsElement):
            values.append(joint.limit_force / joint.tangential_stiffness)
        if isinstance(joint, FrictionContact):
            normal = joint.preload + joint.normal_stiffness * (joint.normal @ rest.displacement - joint.gap)
            limit = joint.friction_coefficient * max(normal, 0.0) / joint.tangential_stiffness
            values += [limit] * len(joint.tangents)
    return np.array(values)


def show(outcome: Outcome) -> Outcome:
    print(
        f"{outcome.system:20s}{outcome.damping_ratio:7.2%} {outcome.kind:10s}{outcome.n_point:7d}{outcome.worst:10.3%}"
        f"{outcome.median:10.3%}{outcome.worst_complex:11.3%}{outcome.peak:10.3%}{outcome.spread:9.2%}{outcome.harmonics:4d}"
        f"{len(outcome.failed):14d}{outcome.seconds:7.1f}",
        flush=True,
    )
    for words in outcome.failed:
        print(f"    not compared: {words}", flush=True)
    return outcome


def blade(witnessed: Any) -> Any:
    """Reduced slotted blade, pressed between two friction contacts in its slots."""
    from fe.assembly import assemble
    from fe.boundary import Support, supported_system
    from fe.element import HEX8
    from fe.material import STEEL
    from fe.mesher.blade import mesh_blade
    from fe.mesher.mesh_rule import MeshRule
    from geometry.blade import Blade
    from reduction.craig_bampton import craig_bampton

    mesh = mesh_blade(Blade(), MeshRule(element=HEX8, through_thickness=2, length_ratio=2.4, length_cap=0.008))
    mass, stiffness = assemble(mesh, STEEL)
    structure = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("clamp"))])
    names = ("excitation", "response", "contact_positive", "contact_negative")
    rom = craig_bampton(structure, {name: structure.rows(mesh.node_sets[name]) for name in names}, 20)
    n = rom.n_dof

    def mean(name: str, axis: int) -> NDArray[np.float64]:
        rows = rom.rows(name, axis)
        return along(n, {int(row): 1 / len(rows) for row in rows})

    # The slots are inclined, so that bending changes the normal load; with 10 N at rest they slip near resonance.
    lean = np.deg2rad(15)
    joints = [
        FrictionContact(
            name=name,
            tangents=np.array([np.cos(lean) * mean(name, 1) - np.sin(lean) * side * mean(name, 0), mean(name, 2)]),
            normal=np.cos(lean) * side * mean(name, 0) + np.sin(lean) * mean(name, 1),
            normal_stiffness=3e5,
            tangential_stiffness=2e5,
            friction_coefficient=0.5,
            preload=10.0,
        )
        for name, side in (("contact_positive", 1.0), ("contact_negative", -1.0))
    ]
    force = {int(np.flatnonzero(mean("excitation", 1))[0]): 60.0}
    system = witnessed.damped(rom.mass, rom.stiffness, joints, 0.005, force)
    first, last = 2 * np.pi * np.array([130.0, 175.0])
    return witnessed.Witnessed(
        system=system, row=mean("response", 1), first=first, last=last, damping_ratio=0.005, histories=(0.2, 1.0, 2.0)
    )


def fixtures() -> Any:
    """Load the module of the test systems, which is not in a package."""
    specification = importlib.util.spec_from_file_location("witness_systems", TESTS)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules["witness_systems"] = module
    specification.loader.exec_module(module)
    return module


if __name__ == "__main__":
    main()
