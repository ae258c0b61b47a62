"""Compare the forced response of chains with friction with pyHarm (PyPI name pyHarm-os), on the same task.

Matrices, Jenkins elements, harmonics (H = 5), samples (128), initial sliders (zero), prescribed frequencies and one
thread are the same. So is the tolerance: that of pyHarm is the largest of its own force residuals at the solutions of
this package, but at least 1e-9 of the load. In both, Newton's method starts from the previous point. pyHarm runs its
own `frf` study with its solver `NewtonRaphson`, predictor `previous` and corrector `nocontinuation`; its default
solver, MINPACK through `scipyroot`, accepts few of these points and is slower. Each package has a separate process;
times are processor times, and imports and compilation (a first run of three points) are reported separately. Run it
with

    python benchmarks/pyharm_race.py [--pyharm-python PYTHON]

PYTHON is an interpreter with pyHarm, which depends on jax and jupyterlab and is best installed separately:

    python -m venv pyharm && pyharm/bin/pip install pyHarm-os==1.2.2
"""

import argparse
import copy
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from processor_time import processor_time

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1") | {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
}
os.environ.update(ONE_THREAD)
N_HARMONIC = 6
N_SAMPLE = 128
#: Options of pyHarm's solvers that make the force residual the only criterion of convergence.
PYHARM_SOLVERS: dict[str, Callable[[float], dict[str, Any]]] = {
    "NewtonRaphson": lambda tolerance: {"tol_residual": tolerance, "tol_delta_x": float("inf"), "max_iter": 40},
}


def chain(n_mass: int, sliding: list[int], frequency_count: int) -> dict[str, Any]:
    """Masses of 1 kg on springs of 1e6 N/m from wall to free end, Jenkins elements to the ground, 10 N at the end."""
    import numpy as np

    stiffness = 1e6 * (2 * np.eye(n_mass) - np.eye(n_mass, k=1) - np.eye(n_mass, k=-1))
    stiffness[-1, -1] = 1e6
    mass = np.eye(n_mass)
    squared = np.linalg.eigvalsh(stiffness)
    stuck = stiffness.copy()
    springs = 2e5 / len(sliding)
    stuck[sliding, sliding] += springs
    first, last = 0.8 * np.sqrt(squared[0]), 1.2 * np.sqrt(np.linalg.eigvalsh(stuck)[0])
    return {
        "mass": mass,
        "damping": 2 * 0.005 / np.sqrt(squared[0]) * stiffness,  # 0.5 % of the first mode
        "stiffness": stiffness,
        "sliding": np.array(sliding),
        "tangential_stiffness": springs,
        "limit_force": 20.0 / len(sliding),
        "force": 10.0,
        "angular_frequency": np.linspace(first, last, frequency_count),
    }


def with_pyharm(problem: dict[str, Any], data: dict[str, Any], answers: Any) -> dict[str, Any]:
    """Solve the problem with pyHarm, in the interpreter that has it.

    Parameters
    ----------
    problem
        Matrices, elements, load and frequencies.
    data
        Input of pyHarm as exported by this package.
    answers
        Coefficients of this package's solutions, shape (p, n_harmonic, r).
    """
    import logging

    start = time.process_time()
    import numpy as np
    from pyHarm.Maestro import Maestro

    imported = time.process_time() - start
    logging.disable(logging.CRITICAL)
    omega = problem["angular_frequency"]
    n_mass = len(problem["mass"])
    ours = [packed(coefficients, w) for coefficients, w in zip(answers, omega, strict=True)]

    def study(solver: str, tolerance: float, count: int) -> Any:
        step = float(omega[1] - omega[0])
        analysis = {
            "study": "frf",
            "solver": solver,
            "solver_options": PYHARM_SOLVERS[solver](tolerance),
            "predictor": "previous",
            "corrector": "nocontinuation",
            "stepsizer": "constant",
            # Otherwise a point that fails is repeated endlessly.
            "stopper": "solnumber",
            "stopper_options": {"max_solutions": count},
            "ds0": step,
            "ds_max": step,
            "ds_min": step / 10,
            "puls_inf": float(omega[0]),
            "puls_sup": float(omega[count - 1] - step / 2),
            "verbose": False,
        }
        # pyHarm modifies its input.
        given = copy.deepcopy(data) | {"analysis": {"curve": analysis}}
        for part in given["substructures"].values():
            part["matrix"] = {name: np.array(rows) for name, rows in part["matrix"].items()}
        return Maestro(given)

    load = float(problem["force"])
    start = time.process_time()
    warm = study("NewtonRaphson", 1e-6 * load, 3)
    warm.operate()
    compiled = time.process_time() - start
    system = warm.system
    residuals = [float(np.linalg.norm(system.Residual(x))) for x in ours]
    tolerance = max(max(residuals), 1e-9 * load)
    result: dict[str, Any] = {
        "import": imported,
        "compilation": compiled,
        "residual_at_ours": max(residuals),
        "tolerance": tolerance,
        "residual": processor_time(lambda: system.Residual(ours[len(ours) // 2]), 20),
        "jacobian": processor_time(lambda: system.Jacobian(ours[len(ours) // 2]), 20),
        "solvers": {},
    }
    for solver in PYHARM_SOLVERS:
        curve = study(solver, tolerance, len(omega))
        start = time.process_time()
        curve.operate()
        seconds = time.process_time() - start
        solutions = curve.nls["curve"].SolList
        accepted = [s for s in solutions if s.flag_accepted]
        result["solvers"][solver] = {
            "seconds": seconds,
            "points": len(solutions),
            "accepted": len(accepted),
            "iterations": sum(float(getattr(s, "iter_numb", np.nan)) for s in accepted) / max(len(accepted), 1),
            "angular_frequency": [float(s.x[-1]) for s in accepted],
            "amplitude": [amplitude(s.x, n_mass) for s in accepted],
        }
    return result


def packed(coefficients: Any, angular_frequency: float) -> Any:
    """Coefficients of e^{i k Omega t} in the order of pyHarm: mean, cosines and sines of each harmonic, frequency."""
    import numpy as np

    rows = [coefficients[0].real]
    for row in coefficients[1:]:
        rows += [row.real, -row.imag]
    return np.concatenate([*rows, [angular_frequency]])


def amplitude(x: Any, n_mass: int) -> float:
    """Amplitude of harmonic 1 at the loaded end [m], from the vector of pyHarm."""
    import numpy as np

    return float(np.hypot(x[2 * n_mass - 1], x[3 * n_mass - 1]))


def with_stickslip(problem: dict[str, Any]) -> dict[str, Any]:
    start = time.process_time()
    import numpy as np

    from hbsolve.balance import HarmonicBalance
    from hbsolve.joint_law.registry import FORCE, JACOBIAN
    from hbsolve.solution import forces_at, residual
    from hbsolve.state import SteadyState
    from hbsolve.steady_state import steady_state
    from reduction.jointed_system import JenkinsElement, JointedSystem, between
    from reduction.pyharm import make_pyharm_input

    imported = time.process_time() - start
    n_mass = len(problem["mass"])
    load = np.zeros((2, n_mass))
    load[1, -1] = problem["force"]
    system = JointedSystem(
        mass=problem["mass"],
        damping=problem["damping"],
        stiffness=problem["stiffness"],
        joints=[
            JenkinsElement(
                name=f"slider {i}",
                direction=between(n_mass, int(i)),
                tangential_stiffness=float(problem["tangential_stiffness"]),
                limit_force=float(problem["limit_force"]),
            )
            for i in problem["sliding"]
        ],
        harmonic_force=load,
    )

    def curve(angular_frequency: Any) -> list[SteadyState]:
        balance = HarmonicBalance(system=system, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
        states: list[SteadyState] = []
        for omega in angular_frequency:
            states.append(steady_state(balance, omega, start=states[-1] if states else None))
        return states

    omegas = problem["angular_frequency"]
    start = time.process_time()
    curve(omegas[:3])
    compiled = time.process_time() - start
    start = time.process_time()
    states = curve(omegas)
    seconds = time.process_time() - start
    balance = HarmonicBalance(system=system, n_harmonic=N_HARMONIC, n_sample=N_SAMPLE)
    middle = states[len(states) // 2]
    condensed, x = balance.at(middle.angular_frequency), middle.motion

    def evaluate(want: int) -> object:
        return residual(balance, condensed, x, forces_at(balance, middle.angular_frequency, x, middle.sliders, want))

    return {
        "import": imported,
        "compilation": compiled,
        "condensation": processor_time(lambda: balance.at(middle.angular_frequency), 50),
        "residual": processor_time(lambda: evaluate(FORCE), 200),
        "both": processor_time(lambda: evaluate(JACOBIAN), 200),
        "seconds": seconds,
        "points": len(omegas),
        "iterations": float(np.mean([state.iterations for state in states])),
        "amplitude": [state.amplitude(n_mass - 1) for state in states],
        "answers": np.array([state.coefficients for state in states]),
        "pyharm": make_pyharm_input(system, omegas[0], omegas[-1], n_harmonic=N_HARMONIC, n_sample=N_SAMPLE),
    }


def run_apart(python: str, package: str, folder: Path) -> dict[str, Any]:
    """Run one package in a separate process; problem and results are files in `folder`."""
    command = [python, str(Path(__file__).resolve()), "--work", package, str(folder)]
    # pyHarm leaves files in its working folder.
    done = subprocess.run(command, env=os.environ | ONE_THREAD, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{package} failed:\n{done.stderr[-3000:]}")
    return dict(json.loads((folder / f"{package}.json").read_text()))


def work(package: str, folder: Path) -> None:
    import numpy as np

    with np.load(folder / "problem.npz") as file:
        problem = dict(file)
    if package == "stickslip":
        result = with_stickslip(problem)
        np.save(folder / "answers.npy", result.pop("answers"))
        (folder / "input.json").write_text(json.dumps(result.pop("pyharm")))
    else:
        data = json.loads((folder / "input.json").read_text())
        result = with_pyharm(problem, data, np.load(folder / "answers.npy"))
    (folder / f"{package}.json").write_text(json.dumps(result))


def report(name: str, ours: dict[str, Any], theirs: dict[str, Any], omegas: Any) -> None:
    import numpy as np

    print(f"\n{name}, {ours['points']} points; times in ms\n")
    print("| | stickslip | pyHarm | ratio |\n|---|---|---|---|")

    def row(what: str, here: float, there: float) -> None:
        print(f"| {what} | {1e3 * here:.3g} | {1e3 * there:.3g} | {there / here:.0f} |")

    row("residual", ours["residual"], theirs["residual"])
    row("residual and Jacobian", ours["both"], theirs["residual"] + theirs["jacobian"])
    for solver, run in theirs["solvers"].items():
        if run["accepted"]:
            row(f"accepted point ({solver})", ours["seconds"] / ours["points"], run["seconds"] / run["accepted"])
    iterations = ", ".join(f"{run['iterations']:.1f} ({solver})" for solver, run in theirs["solvers"].items())
    print(f"| Newton iterations a point | {ours['iterations']:.1f} | {iterations} | |")
    print(f"| import | {1e3 * ours['import']:.0f} | {1e3 * theirs['import']:.0f} | |")
    print(
        f"| first call (kernels from cache) | {1e3 * ours['compilation']:.0f} | {1e3 * theirs['compilation']:.0f} | |"
    )
    print(f"\ncondensing the structure, once per point and part of its time: {1e3 * ours['condensation']:.3g} ms")
    print(f"pyHarm's force residual at this package's answers: {theirs['residual_at_ours']:.1e} N at most,", end=" ")
    print(f"its tolerance: {theirs['tolerance']:.1e} N")
    for solver, run in theirs["solvers"].items():
        print(f"{solver}: {run['accepted']} of {run['points']} tries accepted", end="")
        if run["accepted"]:
            same = [int(np.argmin(abs(omegas - w))) for w in run["angular_frequency"]]
            here, there = np.array(ours["amplitude"])[same], np.array(run["amplitude"])
            off = abs(there - here) / here
            print(
                f"; amplitude of the end differs by {off.max():.1e} at most, {np.median(off):.1e} in the median", end=""
            )
        print()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pyharm-python", default=sys.executable)
    parser.add_argument("--work", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work:
        work(arguments.work[0], Path(arguments.work[1]))
        return
    asked = [
        arguments.pyharm_python,
        "-c",
        "import importlib.util, sys; sys.exit(not importlib.util.find_spec('pyHarm'))",
    ]
    if not shutil.which(arguments.pyharm_python) or subprocess.run(asked, check=False).returncode:
        sys.exit(
            f"{arguments.pyharm_python} cannot import pyHarm: name an interpreter that can with --pyharm-python "
            "(python -m venv pyharm && pyharm/bin/pip install pyHarm-os==1.2.2)"
        )
    import numpy as np

    for name, problem in {
        "3 masses, 1 Jenkins element": chain(3, [0], 100),
        "20 masses, 20 Jenkins elements": chain(20, list(range(20)), 100),
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            np.savez(Path(folder) / "problem.npz", **problem)
            ours = run_apart(sys.executable, "stickslip", Path(folder))
            theirs = run_apart(arguments.pyharm_python, "pyharm", Path(folder))
        report(name, ours, theirs, problem["angular_frequency"])


if __name__ == "__main__":
    main()
