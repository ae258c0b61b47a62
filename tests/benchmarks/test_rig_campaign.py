"""What is measured on a rig on the bench is what its case predicts: written twice, once in time."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.rig_campaign import LINES, SENSORS, HiddenEffect, Specimen, rig_points, systems
from correlation.model import Model
from correlation.model_solver import ModelSolver
from hbsolve.steady_state import steady_state
from pipeline.store import Store
from study.case.setup import read_case
from study.kind.rig.structure import list_measured_places
from study.run_context import silent_run
from transient.virtual_bench.campaign import PARAMETER_DEVIATION
from transient.virtual_bench.sweep import SweepReadings, VirtualSweepTest

CASE = """\
schema = 2
[structure]
kind = "rig"
[structure.material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
[structure.mesh]
element = "hex8"
size = "8 mm"
[structure.reduction]
modes = 20
[structure.contact]
kn = "8.5 N/um"
kt = "4.6 N/um"
mu = 0.8
crowning = "2.5 um"
[structure.dead_weight]
force = "55 N"
[structure.damping]
ratio = "0.2 %"
[harmonics]
highest = 5
"""
#: What the bench reads.
READ = "".join(
    [f'[[sensor]]\nname = "{name}"\nplace = "{name}"\n' for name in SENSORS]
    + [
        f'[[sensor]]\nname = "{line}_{component[0].upper()}"\nline = "{line}"\ncomponent = "{component}"\n'
        for line in LINES
        for component in ("tangential", "normal")
    ]
)
#: Far below the stuck resonance, and at a level at which nothing slips: there is no past to remember.
FREQUENCY, LEVEL = 150.0, 0.5
ORDER = [f"{line}_{component}" for line in LINES for component in "TN"]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Specimen, Model]:
    """A specimen without deviations, and the model of the same mesh."""
    folder = tmp_path_factory.mktemp("rig")
    (folder / "rig.toml").write_text(CASE + READ, encoding="utf-8")
    read = read_case(folder / "rig.toml", run=replace(silent_run(), store=Store(folder / "cache")))
    specimen = Specimen(
        case=read.opened.case,
        reduction=read.structure.details.reduction,
        factors=dict.fromkeys(PARAMETER_DEVIATION, 1.0),
    )
    return specimen, read.model


def measured(specimen: Specimen, effect: HiddenEffect) -> SweepReadings:
    jointed, _ = systems(specimen, effect, 1.0)
    sensors = {name: row for name, row in list_measured_places(specimen.reduction).items() if name in SENSORS}
    # What the contacts carry at rest along their tangents is what the case starts from, too: none.
    return VirtualSweepTest(jointed, sensors, steps_per_period=512).sweep(
        [FREQUENCY], LEVEL, np.zeros(28), tolerance=1e-6
    )


def predicted(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Harmonic 1 of the motions, and harmonics 0 and 1 of the lines' forces."""
    solver = ModelSolver.from_model(model, False, None)
    state = steady_state(solver.balance.at_level(LEVEL), 2 * np.pi * FREQUENCY)
    motion = solver.read(state, np.array(SENSORS), np.ones(len(SENSORS), dtype=np.int64))
    force = [solver.read(state, np.array(ORDER), np.full(len(ORDER), k)) for k in (0, 1)]
    return motion, np.array(force)


def test_the_bench_measures_what_the_case_predicts(drawn: tuple[Specimen, Model]) -> None:
    specimen, model = drawn
    readings = measured(specimen, HiddenEffect(kind="nothing"))
    motion, force = predicted(model)
    # 512 steps a period of an almost linear motion: 1e-4 and better.
    np.testing.assert_allclose(readings.motion[0, :, 0], motion, rtol=1e-3)
    normal = slice(1, None, 2)
    np.testing.assert_allclose(readings.force[0, normal, 0].real, force[0, normal].real, rtol=1e-3)
    largest = np.abs(force[1]).max()
    np.testing.assert_allclose(readings.force[0, :, 1], force[1], atol=2e-3 * largest)


def test_a_lighter_dead_weight_is_the_effect_of_that_name(drawn: tuple[Specimen, Model]) -> None:
    specimen, model = drawn
    readings = measured(specimen, HiddenEffect(kind="preload", strength=-7.0))
    before = measured(specimen, HiddenEffect(kind="nothing"))
    _, force = predicted(model.with_preload_ratio("left dead weight", 1 - 7 / 55))
    _, nominal = predicted(model)
    # The bench finds rest anew from unloaded bodies, the model moves on from the rest that it has: lines of the left
    # lose an eighth of their normal force in both, those of the right next to nothing. What the tangents carry has
    # another past in the two, some hundredths of a newton.
    lost = (readings.force[0, 1::2, 0] - before.force[0, 1::2, 0]).real
    np.testing.assert_allclose(lost, (force[0, 1::2] - nominal[0, 1::2]).real, rtol=0.05, atol=0.05)
    assert (lost[:2] < -0.1 * nominal[0, 1:4:2].real).all()
    assert (np.abs(lost[2:]) < 0.01 * nominal[0, 5::2].real).all()


def test_a_rig_is_measured_about_its_own_first_bending(drawn: tuple[Specimen, Model]) -> None:
    specimen, _ = drawn
    drawn_points, heavy = (rig_points(specimen, HiddenEffect(kind="mass", strength=mass)) for mass in (0.0, 4e-3))
    # Below it dampers roll, or hang from soft springs, and no force on the blade moves them; above it is the second
    # bending, near 900 Hz, which moves the tip more at the force. Few bricks of eight nodes are too stiff by a sixth.
    for points, low, high in ((drawn_points.frequencies, 240, 300), (drawn_points.free_frequencies, 110, 160)):
        assert low < points[0] < points[-1] < high
    # 4 g beside a modal mass of 0.2 kg: 1 %.
    np.testing.assert_allclose(np.array(heavy.frequencies) / drawn_points.frequencies, 0.99, atol=0.01)
    assert heavy.frequencies[0] < drawn_points.frequencies[0]
