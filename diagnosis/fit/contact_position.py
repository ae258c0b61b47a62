r"""Position of the contacts along their lines: nearer to the middle, or further out, than in the model.

The contacts of a line are at x_i from the centre of their load in the model, and at s x_i in the structure. Rows and
gaps at s x_i are interpolated quadratically between neighbours. Shares w_i of stiffness and preload are moved between
middle and ends so that their sum and second moment are preserved,

.. math:: \sum_i w_i' = \sum_i w_i, \qquad \sum_i w_i' (s x_i)^2 = \sum_i w_i x_i^2 ,

and with them the stiffness of the stuck structure. Only the onset of slip at each end changes.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from correlation.noise.nuisance import compute_parabolic_share
from reduction.jointed_system import FrictionContact, Joint

Vector = Float[NDArray[np.float64], " n"]

SHARED = ("tangential_stiffness", "normal_stiffness", "preload")
#: Least part of its share that a contact keeps, since shares are moved between inner and end contacts.
MIN_SHARE_LEFT = 0.1


def with_contact_position(model: Model, factor: float) -> Model:
    """Model with the contacts of all lines at `factor` times their distance from the middle; 1 changes nothing."""
    if factor == 1.0:
        return model
    moved: dict[str, FrictionContact] = {}
    static = np.array(model.system.static_load)
    for names in model.lines.values():
        if len(names) < 3:
            continue
        contacts = [model.contact(name) for name in names]
        for before, after in zip(contacts, _move_contacts(contacts, factor), strict=True):
            moved[before.name] = after
            static += after.preload * after.normal - before.preload * before.normal
    joints: list[Joint] = [moved.get(joint.name, joint) for joint in model.system.joints]
    return model.with_system(joints=joints, static_load=static)


def find_contact_position_bounds(model: Model, lower: float, upper: float) -> tuple[float, float]:
    """Bounds of the factor within the given ones such that every contact keeps `MIN_SHARE_LEFT` of its share."""
    for names in model.lines.values():
        if len(names) < 3:
            continue
        contacts = [model.contact(name) for name in names]
        place = _compute_places(contacts)
        rates = np.array([_rate(_list_values(contacts, name), place) for name in SHARED])
        taken, given = float(-rates.min()), float(rates.max())
        if taken > 0:
            lower = max(lower, float((1 + (1 - MIN_SHARE_LEFT) / taken) ** -0.5))
        if given > 1 - MIN_SHARE_LEFT:
            upper = min(upper, float((1 - (1 - MIN_SHARE_LEFT) / given) ** -0.5))
    return lower, upper


def _move_contacts(contacts: list[FrictionContact], factor: float) -> list[FrictionContact]:
    place = _compute_places(contacts)
    table = _make_interpolation(place, factor * place)
    tangents = np.einsum("ij,jkr->ikr", table, np.array([contact.tangents for contact in contacts]))
    normal = table @ np.array([contact.normal for contact in contacts])
    gap = table @ np.array([contact.gap for contact in contacts])
    kt, kn, preload = (_redistribute_values(_list_values(contacts, name), place, factor) for name in SHARED)
    return [
        replace(
            contact, tangents=tangents[i], normal=normal[i], gap=float(gap[i]),
            tangential_stiffness=float(kt[i]), normal_stiffness=float(kn[i]), preload=float(preload[i]),
        )
        for i, contact in enumerate(contacts)
    ]  # fmt: skip


def _list_values(contacts: list[FrictionContact], name: str) -> Vector:
    return np.array([getattr(contact, name) for contact in contacts])


def _compute_places(contacts: list[FrictionContact]) -> Vector:
    """Evenly spaced positions along the line, from the centre of the load."""
    place, weight = np.linspace(-1, 1, len(contacts)), _list_values(contacts, "normal_stiffness")
    return np.asarray(place - weight @ place / weight.sum())


def _redistribute_values(values: Vector, place: Vector, factor: float) -> Vector:
    return np.asarray(values * (1 + (1 / factor**2 - 1) * _rate(values, place)))


def _rate(values: Vector, place: Vector) -> Vector:
    """Relative change of each share that doubles the moment of inertia and keeps the sum."""
    pattern = compute_parabolic_share(values)
    change = values * pattern @ place**2
    return np.zeros(len(values)) if change == 0 else np.asarray((values @ place**2) / change * pattern)


def _make_interpolation(place: Vector, at: Vector) -> Float[NDArray[np.float64], "n n"]:
    """Lagrange's parabolas through the three nearest places."""
    table = np.zeros((len(at), len(place)))
    for i, x in enumerate(at):
        first = int(np.clip(np.argmin(np.abs(place - x)) - 1, 0, len(place) - 3))
        near = place[first : first + 3]
        for j in range(3):
            others = np.delete(near, j)
            table[i, first + j] = np.prod((x - others) / (near[j] - others))
    return table
