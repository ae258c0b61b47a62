"""A small bench: a chain of two directions on a stand, rubbing in two lines of three contacts."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.model import Dof, LineSensor, Model, Sensor, StructurePart
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue, list_effects
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from reduction.jointed_system import FrictionContact, JointedSystem, along

#: Nodes 0 to 2 of the beam move in z and x, degrees of freedom 2 n and 2 n + 1; then the stand in z.
N, STAND = 7, 6
SHARE = (0.25, 0.5, 0.25)
#: Where the contacts of a line sit between node 1 (0) and node 2 (1), unevenly.
STATION = (0.1, 0.3, 0.9)


def line(name: str, slope: float, preload: float, normal_share: float) -> list[FrictionContact]:
    contacts = []
    for number, (share, where) in enumerate(zip(SHARE, STATION, strict=True)):
        z = along(N, {2: 1 - where, 4: where})
        x = along(N, {3: 1 - where, 5: where})
        contacts.append(
            FrictionContact(
                name=f"{name} {number}",
                normal=slope * z + normal_share * x,
                tangents=0.9 * z,
                normal_stiffness=share * 4e4,
                tangential_stiffness=share * 3e4,
                friction_coefficient=0.4,
                preload=share * preload,
            )
        )
    return contacts


def chain(stiffness: float, ground: float) -> NDArray[np.float64]:
    K = stiffness * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    K[0, 0] += ground
    return K


def make_bench() -> Model:
    beam_mass, beam, stand_mass, stand = (np.zeros((N, N)) for _ in range(4))
    z, x = [0, 2, 4], [1, 3, 5]
    beam_mass[z, z] = beam_mass[x, x] = (1.0, 1.2, 0.7)
    beam[np.ix_(z, z)] = chain(4e4, 1e4)
    beam[np.ix_(x, x)] = chain(4e6, 1e6)
    stand_mass[STAND, STAND], stand[STAND, STAND] = 5.0, 4e6
    coupling = along(N, {0: 1.0, STAND: -1.0})
    beam += 2e4 * np.outer(coupling, coupling)
    M, K = beam_mass + stand_mass, beam + stand
    joints = [*line("left", 0.5, 8.0, 0.8), *line("right", -0.5, 8.0, -0.8)]
    force = np.zeros((2, N))
    force[1, 4] = 1.0
    system = JointedSystem(
        mass=M,
        damping=0.8 * M + 5e-6 * K,
        stiffness=K,
        joints=joints,
        static_load=sum(joint.preload * joint.normal for joint in joints),
        harmonic_force=force,
    )
    dofs = [
        Dof(body="beam", node=node, direction=direction, coordinates=np.array([0.1 * node, 0.0, 0.0]))
        for node in range(3)
        for direction in ("z", "x")
    ]
    return Model(
        system=system,
        sensors=(
            Sensor(name="tip", row=along(N, {4: 1.0})),
            LineSensor(name="left_T", line="left", component="tangential"),
            LineSensor(name="left_N", line="left", component="normal", gain=1.5),
        ),
        parts=(
            StructurePart(name="beam", mass=beam_mass, stiffness=beam),
            StructurePart(name="stand", mass=stand_mass, stiffness=stand),
        ),
        dofs=(*dofs, Dof(body="stand", node=0, direction="z")),
        lines={side: tuple(f"{side} {number}" for number in range(3)) for side in ("left", "right")},
        places={
            "tip z": along(N, {4: 1.0}),
            "tip x": along(N, {5: 1.0}),
            "root z": along(N, {0: -1.0}),
            "slot z": along(N, {2: 0.7, 4: 0.3}),
            "stand z": along(N, {STAND: 1.0}),
        },
    )


@pytest.fixture(scope="session")
def bench() -> Model:
    return make_bench()


@pytest.fixture(scope="session")
def paper() -> ModuleType:
    """A small structure tested on paper, and what makes its campaigns: those of the tests of `correlation`."""
    where = Path(__file__).parents[1] / "correlation" / "conftest.py"
    spec = spec_from_file_location("paper_campaign", where)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["paper_campaign"] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def small(paper: ModuleType) -> Model:
    return paper.make_small()


@pytest.fixture(scope="session")
def listed(small: Model, paper: ModuleType) -> Catalogue:
    return list_effects(small, level=paper.LEVELS[1])


@pytest.fixture(scope="session")
def heavy_campaign(small: Model, paper: ModuleType, listed: Catalogue) -> Campaign:
    """It hides 5 g at "mass at tip z"."""
    return paper.make_campaign(listed.effect("mass at tip z").apply(small, [5e-3]), jitter=3e-5, seed=5)


@pytest.fixture(scope="session")
def heavy(small: Model, heavy_campaign: Campaign) -> Arrangement:
    """Of the campaign that hides a mass."""
    return arrange(
        heavy_campaign,
        small,
        list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0}),
        Budget(frequency=0.0, compliance=0.0),
    )
