"""Random structures: chains, beams, frames, pairs of beams and plates, with contacts that slip at high levels.

The ranges were fixed before the first score. The first free resonances are at 5 to 500 Hz.

kind         chain of 4 to 20 masses; cantilever, hinged or elastically supported beam; portal or angle frame; two
             cantilevers side by side; plate clamped at one edge, at two, or on springs: 4 to about 170 degrees of
             freedom
mode         the test is at the resonance of one of the first three modes, with the contacts stuck
contacts     none (10 %), or 1 to 4 groups of 1 to 3, each group of one kind: wedge to the ground, wedge between two
             points (of different bodies if there are two), Jenkins elements (constant normal load), open at rest
stiffness    the contacts together add 5 to 35 % to the modal stiffness of the tested mode
preload      the linear motion at the highest level is 1.5 to 5 times that at the onset of slip; a gap is 30 to 80 % of
             the linear motion
damping      0.2 to 1.5 %, modal or Rayleigh; up to two dashpots that add up to 40 % together
cubic        in a fifth of the structures a hardening spring of 2 to 10 % of the modal stiffness at the highest level
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy.linalg

from benchmarks.random_systems import log_uniform
from benchmarks.strangers.blueprint import Blueprint, Contact, Jenkins, Mesh
from benchmarks.strangers.skeleton import Chain, Frame, Member, Motion, Plate, Row, Skeleton, Spot

KINDS = ("chain", "beam", "frame", "pair", "plate")
GROUPS = ("wedge", "between", "jenkins", "open")
#: Smallest motion of a contact, place or drive in the tested mode, relative to the largest motion [-].
MOVES = 0.2
#: Smallest ratio of the response at the tested resonance to that at both ends of the swept band, with contacts stuck;
#: limits of the band, relative to the free and the stuck resonance [-].
STANDS, BAND = 2.0, (0.95, 1.04)


def draw_structure(random: np.random.Generator) -> Blueprint:
    """Draw a structure whose tested resonance is visible at the drive; others are drawn again."""
    while True:
        plan = _draw(random)
        if _stands_out(plan):
            return plan


def _stands_out(plan: Blueprint) -> bool:
    """Whether the tested resonance is visible at the drive with all closed contacts stuck."""
    skeleton = plan.mesh.build(1)
    stiffness = skeleton.stiffness.astype(complex)
    for line, contacts in plan.lines.items():
        for contact in contacts if not line.startswith("open") else ():
            for motion, spring in (
                (contact.tangent, contact.tangential_stiffness),
                (contact.normal, contact.normal_stiffness),
            ):
                stiffness += spring * np.outer(skeleton.row(motion), skeleton.row(motion))
    for jenkins in plan.jenkins.values():
        stiffness += jenkins.stiffness * np.outer(skeleton.row(jenkins.motion), skeleton.row(jenkins.motion))
    drive, damping = skeleton.row(((plan.places[plan.drive], 1.0),)), plan.damping(skeleton)
    below = min(BAND[0] * plan.free, 0.97 * plan.stuck)
    there, *ends = (
        abs(drive @ np.linalg.solve(stiffness - omega**2 * skeleton.mass + 1j * omega * damping, drive))
        for omega in (plan.stuck, below, BAND[1] * plan.stuck)
    )
    return bool(there > STANDS * max(ends))


def _draw(random: np.random.Generator) -> Blueprint:
    kind = str(random.choice(KINDS))
    mesh, finer = _mesh(kind, random)
    skeleton = mesh.build(1)
    squared, shapes = scipy.linalg.eigh(skeleton.stiffness, skeleton.mass)
    tested = int(random.choice(3, p=[0.65, 0.25, 0.1]))
    plan = Blueprint(
        kind=kind, mesh=mesh, finer=finer, ratio=float(log_uniform(random, 2e-3, 1.5e-2)),
        rayleigh=bool(random.uniform() < 0.5), highest=float(np.sqrt(squared[tested + 1])),
        force=float(log_uniform(random, 1.0, 50.0)),
    )  # fmt: skip
    plan = _with_places(plan, skeleton, shapes[:, tested], random)
    return _with_joints(plan, skeleton, squared[tested], shapes[:, tested], random)


def _mesh(kind: str, random: np.random.Generator) -> tuple[Mesh, int]:
    """Draw a mesh of a kind; returns it and the refinement of the specimen's mesh."""
    if kind == "chain":
        n = int(random.integers(4, 21))
        masses, springs = log_uniform(random, 0.3, 3.0, n), log_uniform(random, 2e5, 5e6, n - 1)
        pairs = {(number, number + 1): float(spring) for number, spring in enumerate(springs)}
        for _ in range(int(random.integers(0, n // 3 + 1))):
            one, other = sorted(random.choice(n, 2, replace=False).tolist())
            pairs[one, other] = float(log_uniform(random, 2e5, 5e6))
        supported = {0, *random.choice(n, max(n // 6, 1), replace=False).tolist()}
        return Chain(
            masses=masses, springs=pairs, grounded={item: float(log_uniform(random, 3e5, 3e6)) for item in supported}
        ), 1
    steel, density = 2.1e11, 7800.0
    if kind == "plate":
        size = float(random.uniform(0.2, 0.6)), float(random.uniform(0.2, 0.6))
        count = int(random.integers(3, 8)), int(random.integers(3, 7))
        thick = float(log_uniform(random, 1.5e-3, 6e-3))
        section = steel * thick**3 / 12 / (1 - 0.3**2), 0.3, density * thick
        support = str(random.choice(["edge", "edges", "springs"]))
        corners = [Spot("plate", (x, y, 0.0), "z") for x in (0.0, size[0]) for y in (0.0, size[1])]
        modal = section[2] * size[0] * size[1] * (2 * np.pi * 20) ** 2
        springs = {spot: float(modal * random.uniform(0.5, 2)) for spot in corners}
        clamped = {"edge": (0,), "edges": (0, 1), "springs": ()}[support]
        return Plate(
            size=size, n_element=count, section=section, clamped=clamped,
            springs=springs if support == "springs" else {},
        ), 2  # fmt: skip
    length, height, width = float(random.uniform(0.25, 0.8)), float(log_uniform(random, 4e-3, 1.5e-2)), 0.03
    section = steel * width * height, steel * width * height**3 / 12, density * width * height
    n = int(random.integers(4, 13))
    if kind == "pair":
        lengths = length, length * float(random.uniform(0.8, 1.0))
        members = [
            Member(body=body, begin=(0.0, 0.0, z), end=(long, 0.0, z), n_element=n)
            for body, long, z in zip("ab", lengths, (0.0, 0.05), strict=True)
        ]
        fixed = [Spot(member.body, member.begin, "*") for member in members]
        return Frame(members=members, section=section, fixed=fixed, springs={}, axial=False), 2
    if kind == "beam":
        members = [Member(body="beam", begin=(0.0, 0.0, 0.0), end=(length, 0.0, 0.0), n_element=n)]
        ends = [Spot("beam", members[0].begin, "z"), Spot("beam", members[0].end, "z")]
        support = random.choice(["clamped", "hinged", "elastic"])
        stiff = 48 * section[1] / length**3
        return Frame(
            members=members, section=section, axial=False,
            fixed={"clamped": [Spot("beam", members[0].begin, "*")], "hinged": ends, "elastic": []}[support],
            springs={spot: stiff * float(random.uniform(0.5, 3)) for spot in ends} if support == "elastic" else {},
        ), 2  # fmt: skip
    high, n = length * float(random.uniform(0.5, 1.2)), max(n // 2, 3)
    corners = [(0.0, 0.0, 0.0), (0.0, 0.0, high), (length, 0.0, high), (length, 0.0, 0.0)]
    corners = corners if random.uniform() < 0.5 else corners[:3]
    members = [Member(body="frame", begin=one, end=other, n_element=n) for one, other in pairwise(corners)]
    feet = [corners[0], *([corners[3]] if len(corners) == 4 else [])]
    return Frame(
        members=members, section=section, fixed=[Spot("frame", foot, "*") for foot in feet], springs={}, axial=True
    ), 2


def _with_places(plan: Blueprint, skeleton: Skeleton, shape: Row, random: np.random.Generator) -> Blueprint:
    """Blueprint with three to six places: moving translations at different points, one of them the drive."""
    moving = _moving(skeleton, shape)
    chosen: list[Spot] = []
    for number in random.permutation(moving).tolist():
        spot = skeleton.spots[number]
        if all((spot.body, spot.point) != (item.body, item.point) for item in chosen):
            chosen.append(spot)
    chosen = chosen[: int(random.integers(3, 7))]
    places = {f"{spot.body} {letter}": spot for letter, spot in zip("ABCDEF", chosen, strict=False)}
    return replace(plan, places=places, drive=str(random.choice(list(places))))


def _moving(skeleton: Skeleton, shape: Row) -> list[int]:
    """Numbers of the translations that move in a mode."""
    translations = [number for number, spot in enumerate(skeleton.spots) if spot.direction in "xyz"]
    largest = np.abs(shape[translations]).max()
    return [number for number in translations if abs(shape[number]) > MOVES * largest]


def _with_joints(
    plan: Blueprint, skeleton: Skeleton, squared: float, shape: Row, random: np.random.Generator
) -> Blueprint:
    """Blueprint with contacts, cubic spring and dashpots, with stiffnesses and preloads from the tested mode."""
    groups = [] if random.uniform() < 0.1 else [str(item) for item in random.choice(GROUPS, int(random.integers(1, 5)))]
    share = random.uniform(0.05, 0.35) / max(len(groups), 1)
    drafts = [_draft(kind, skeleton, shape, squared * share, random) for kind in groups]
    stuck = skeleton.stiffness.copy()
    for kind, draft in zip(groups, drafts, strict=True):
        for contact in draft if kind != "open" else ():
            for motion, spring in (
                (contact.tangent, contact.tangential_stiffness), (contact.normal, contact.normal_stiffness)
            ):  # fmt: skip
                row = skeleton.row(motion)
                stuck += spring * np.outer(row, row)
    stuck_squared, shapes = scipy.linalg.eigh(stuck, skeleton.mass)
    mode = int(np.abs(shapes.T @ skeleton.mass @ shape).argmax())
    natural = float(np.sqrt(stuck_squared[mode]))
    driven = skeleton.row(((plan.places[plan.drive], 1.0),)) @ shapes[:, mode]
    # Motion of the linear structure at resonance under the highest force.
    motion = np.abs(shapes[:, mode] * driven) * plan.force / (2 * plan.ratio * natural**2)
    lines: dict[str, list[Contact]] = {}
    jenkins: dict[str, Jenkins] = {}
    for number, (kind, draft) in enumerate(zip(groups, drafts, strict=True), start=1):
        slip, name = random.uniform(1.5, 5.0), f"{kind}{number}"
        seen = [_moved(skeleton.row(contact.tangent), shapes[:, mode], motion) for contact in draft]
        force = [contact.tangential_stiffness * item / slip for contact, item in zip(draft, seen, strict=True)]
        if kind == "jenkins":
            jenkins |= {
                f"{name} {place}": Jenkins(motion=item.tangent, stiffness=item.tangential_stiffness, limit=limit)
                for place, (item, limit) in enumerate(zip(draft, force, strict=True), start=1)
            }
        elif kind == "open":
            lines[name] = [
                replace(item, gap=random.uniform(0.3, 0.8) * _moved(skeleton.row(item.normal), shapes[:, mode], motion))
                for item in draft
            ]
        else:
            pairs = zip(draft, force, strict=True)
            lines[name] = [replace(item, preload=limit / item.friction_coefficient) for item, limit in pairs]
    return replace(
        plan, lines=lines, jenkins=jenkins, cubic=_cubic(plan, skeleton, motion, natural, shapes[:, mode], random),
        dashpots=_dashpots(plan, skeleton, natural, shapes[:, mode], random), free=float(np.sqrt(squared)),
        stuck=natural,
    )  # fmt: skip


def _moved(row: Row, shape: Row, motion: Row) -> float:
    """Amplitude along a row in a mode whose degrees of freedom have the amplitudes `motion`."""
    largest = int(np.abs(shape).argmax())
    return float(abs(row @ shape) * motion[largest] / abs(shape[largest]))


def _draft(kind: str, skeleton: Skeleton, shape: Row, modal: float, random: np.random.Generator) -> list[Contact]:
    """Draw a group of contacts without preloads that adds `modal` to the modal stiffness of a mode [1/s^2]."""
    moving = [skeleton.spots[number] for number in random.permutation(_moving(skeleton, shape))]
    angle, ratio = np.deg2rad(random.uniform(15, 50)), random.uniform(0.6, 2.0)
    friction, count = random.uniform(0.2, 0.7), int(random.integers(1, 4))
    motions: list[Motion] = []
    for spot in moving:
        others = [item for item in moving if item.direction == spot.direction and item != spot]
        bodies = [item for item in others if item.body != spot.body]
        if kind == "between" and (bodies or others):
            other = (bodies or others)[0]
            motions.append(((spot, 1.0), (other, -1.0)))
        else:
            motions.append(((spot, 1.0),))
    felt = [abs(skeleton.row(motion) @ shape) for motion in motions]
    able = [motion for motion, item in zip(motions, felt, strict=True) if item > 0.3 * max(felt)][:count]
    if kind == "jenkins":
        angle = 0.0
    steep = np.pi / 2 - angle if kind == "open" else angle
    contacts = []
    for motion in able:
        across = np.cos(steep) ** 2 + ratio * np.sin(steep) ** 2
        spring = modal / len(able) / (across * (skeleton.row(motion) @ shape) ** 2)
        contacts.append(
            Contact(
                normal=tuple((spot, weight * float(np.sin(steep))) for spot, weight in motion),
                tangent=tuple((spot, weight * float(np.cos(steep))) for spot, weight in motion),
                normal_stiffness=float(spring * ratio), tangential_stiffness=float(spring),
                friction_coefficient=float(friction), preload=0.0,
            )
        )  # fmt: skip
    return contacts


def _cubic(
    plan: Blueprint, skeleton: Skeleton, motion: Row, natural: float, shape: Row, random: np.random.Generator
) -> dict[str, tuple[str, float]]:
    """Hardening spring in a fifth of the structures: place and stiffness k [N/m^3] by name.

    3/4 k a^2 is 2 to 10 % of the modal stiffness of the place.
    """
    if random.uniform() > 0.2:
        return {}
    place = str(random.choice(list(plan.places)))
    number = skeleton.number(plan.places[place])
    spring = random.uniform(0.02, 0.1) * natural**2 / shape[number] ** 2
    return {"hardening": (place, float(spring / (0.75 * motion[number] ** 2)))}


def _dashpots(
    plan: Blueprint, skeleton: Skeleton, natural: float, shape: Row, random: np.random.Generator
) -> dict[str, float]:
    """Up to two dampers by place, each adding 5 to 20 % of the modal damping."""
    places = random.permutation(list(plan.places))[: int(random.integers(0, 3))].tolist()
    return {
        place: float(
            random.uniform(0.05, 0.2) * 2 * plan.ratio * natural / shape[skeleton.number(plan.places[place])] ** 2
        )
        for place in places
    }
