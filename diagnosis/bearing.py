r"""Where along their lines the contacts bear: nearer to the middle, or further out, than they are drawn.

With the places x_i of a line's contacts measured from the middle of what they carry, the true ones are s x_i. Rows and
gaps there follow by quadratic interpolation between neighbours; what the contacts share is moved between middle and
ends so that the line keeps its sum and its moment of inertia,

.. math:: \sum_i w_i' = \sum_i w_i, \qquad \sum_i w_i' (s x_i)^2 = \sum_i w_i x_i^2 ,

and with them the stuck structure its stiffness: what changes is when which end slips.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.nuisance import bulge
from correlation.test_model import TestModel
from reduction.jointed_system import FrictionContact, Joint

Vector = Float[NDArray[np.float64], " n"]

SHARED = ("tangential_stiffness", "normal_stiffness", "preload")


def with_bearing(test_model: TestModel, factor: float) -> TestModel:
    """The model with the contacts of all lines at `factor` times their distance from the middle; 1 changes nothing."""
    if factor == 1.0:
        return test_model
    moved: dict[str, FrictionContact] = {}
    static = np.array(test_model.system.static_load)
    for names in test_model.lines.values():
        if len(names) < 3:
            continue
        contacts = [test_model.contact(name) for name in names]
        for before, after in zip(contacts, _moved(contacts, factor), strict=True):
            moved[before.name] = after
            static += after.preload * after.normal - before.preload * before.normal
    joints: list[Joint] = [moved.get(joint.name, joint) for joint in test_model.system.joints]
    return test_model.with_system(joints=joints, static_load=static)


def _moved(contacts: list[FrictionContact], factor: float) -> list[FrictionContact]:
    place = np.linspace(-1, 1, len(contacts))
    weight = np.array([contact.normal_stiffness for contact in contacts])
    place = place - weight @ place / weight.sum()
    table = _interpolation(place, factor * place)
    tangents = np.einsum("ij,jkr->ikr", table, np.array([contact.tangents for contact in contacts]))
    normal = table @ np.array([contact.normal for contact in contacts])
    gap = table @ np.array([contact.gap for contact in contacts])
    kt, kn, preload = (_shared(np.array([getattr(each, name) for each in contacts]), place, factor) for name in SHARED)
    return [
        replace(
            contact, tangents=tangents[i], normal=normal[i], gap=float(gap[i]),
            tangential_stiffness=float(kt[i]), normal_stiffness=float(kn[i]), preload=float(preload[i]),
        )
        for i, contact in enumerate(contacts)
    ]  # fmt: skip


def _shared(values: Vector, place: Vector, factor: float) -> Vector:
    pattern = bulge(values)
    change = values * pattern @ place**2
    return values if change == 0 else values * (1 + (1 / factor**2 - 1) * (values @ place**2) / change * pattern)


def _interpolation(place: Vector, at: Vector) -> Float[NDArray[np.float64], "n n"]:
    """Lagrange's parabolas through the three nearest places."""
    table = np.zeros((len(at), len(place)))
    for i, x in enumerate(at):
        first = int(np.clip(np.argmin(np.abs(place - x)) - 1, 0, len(place) - 3))
        near = place[first : first + 3]
        for j in range(3):
            others = np.delete(near, j)
            table[i, first + j] = np.prod((x - others) / (near[j] - others))
    return table
