r"""Equilibrium under static loads, with contacts that may open and do not slide.

.. math:: K q + \sum_i N_i n_i + \sum_i k_t t_i (t_i q) = f, \qquad N_i = \max(k_n (n_i q - g_i), 0)

In later computations, a contact that is closed in this state has the preload N_i, and an open contact has the remaining
gap. Motion is then measured from this state, under the load f - K q, which the contacts balance if their sliders start
at -T / k_t.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), section 3.1, eq. 6.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from fe.blas_threads import on_one_blas_thread
from reduction.array_input import freeze_arrays, make_read_only
from reduction.array_type import Matrix, Real, Row, Vector
from reduction.errors import JointError
from reduction.joint_law.friction_contact import Friction, FrictionContact
from reduction.stuck import stuck_stiffness

#: Largest number of iterations per contact; each iteration opens or closes some contacts, and usually few are needed.
MAX_ROUNDS = 20
#: Approach relative to the largest below which a contact touches without a force.
TOUCH = 1e-12
#: Springs to the ground during the search for closed contacts, relative to the diagonal of the stuck stiffness.
GROUND = 1e-10
#: Pivot of the scaled stuck stiffness below which it is singular.
SINGULAR = 1e-12
FREE = (
    "there is no equilibrium under the static load: the contacts that stay closed leave a body free; check the "
    "direction of the load, and gaps"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class StaticState:
    """Equilibrium under a load; arrays are copied and read-only."""

    contacts: tuple[FrictionContact, ...]
    """Contacts with the preloads and gaps of this state."""
    displacement: Row
    """Displacement q, shape (r,) [m]."""
    load: Row
    """Load f - K q that the contacts balance, shape (r,) [N]."""
    normal: Float[Real, " c"]
    """Normal force N of each contact, shape (c,) [N]."""
    tangential: tuple[Float[Real, " t"], ...]
    """Friction force T of each contact along each of its tangents, one array per contact [N]."""

    def __post_init__(self) -> None:
        freeze_arrays(self, "displacement", "load", "normal")
        object.__setattr__(self, "tangential", tuple(make_read_only(np.array(item)) for item in self.tangential))
        object.__setattr__(self, "contacts", tuple(self.contacts))

    @property
    def slider(self) -> Float[Real, " s"]:
        """Slider positions of all contacts in equilibrium, -T / k_t, shape (s,) [m]."""
        pairs = zip(self.contacts, self.tangential, strict=True)
        return np.concatenate([np.zeros(0), *(-force / item.tangential_stiffness for item, force in pairs)])

    @property
    def ratio(self) -> Float[Real, " c"]:
        """Ratio |T| / (mu N) of each contact, zero without friction force, shape (c,) [-]; above 1 it would slide.

        With uncoupled tangents, |T| is the larger of the two friction forces.
        """
        limit = np.array([item.limit_at_rest for item in self.contacts])
        size = np.array(
            [_compute_size(item, force) for item, force in zip(self.contacts, self.tangential, strict=True)]
        )
        unlimited = np.where(size > 0, np.inf, 0.0)
        return np.asarray(np.divide(size, limit, out=unlimited, where=limit > 0))


@on_one_blas_thread
def static_state(
    stiffness: Matrix, contacts: Sequence[FrictionContact], load: Row, lines: Mapping[str, Sequence[str]] | None = None
) -> StaticState:
    """Compute the equilibrium under a load.

    Parameters
    ----------
    stiffness
        Stiffness K without contacts, shape (r, r) [N/m].
    contacts
        Unloaded contacts, with zero preload and the gaps of the bodies before loading.
    load
        Static load f, shape (r,) [N].
    lines
        Names of the contacts of each line; a line that opens along its whole length is refused. None by default.

    Raises
    ------
    JointError
        A contact with a preload, no equilibrium (a body that the closed contacts do not hold), or a line that opens
        along its whole length.
    """
    pressed = [item.name for item in contacts if item.preload]
    if pressed:
        raise JointError(
            f'contact "{pressed[0]}" has a preload, but this is a result of the static solution: remove it'
        )
    rows = np.array([item.normal for item in contacts]).reshape(-1, len(stiffness))
    k_n = np.array([item.normal_stiffness for item in contacts])
    gap = np.array([item.gap for item in contacts])
    # Very soft springs to the ground let a body that the closed contacts leave free move until it meets the next
    # contact; the final equilibrium is computed without them.
    ground = GROUND * np.diag(np.diag(_stick_closed(stiffness, contacts, np.ones(len(contacts), dtype=bool))))
    closed = np.ones(len(contacts), dtype=bool)
    seen: set[bytes] = set()
    most = MAX_ROUNDS * max(len(contacts), 1)
    for round_ in range(most):
        moved = _find_rest(stiffness + ground, contacts, closed, rows, k_n, gap, load)
        if moved is None:
            raise JointError(FREE)
        approach = rows @ moved - gap
        # Contacts that touch without a force keep their state, so that round-off does not open and close them forever.
        touch = TOUCH * float(np.abs(approach).max(initial=0.0))
        now = np.where(closed, approach >= -touch, approach > touch)
        wrong = np.flatnonzero(now != closed)
        if not len(wrong):
            break
        seen.add(closed.tobytes())
        # A repeated set of closed contacts would repeat forever: then only the contact with the largest error changes,
        # and in late rounds the last wrong contact, which terminates (Murty's rule).
        if round_ > most // 2:
            now = _toggle_contact(closed, int(wrong[-1]))
        elif now.tobytes() in seen:
            order = wrong[np.argsort(-np.abs(approach[wrong]) * k_n[wrong])]
            tries = [_toggle_contact(closed, int(one)) for one in order]
            now = next((item for item in tries if item.tobytes() not in seen), tries[0])
        closed = now
    else:
        raise JointError(
            f"no equilibrium was found under the static load in {MAX_ROUNDS} iterations per contact: check loads "
            "and gaps"
        )
    _refuse_open(lines or {}, contacts, closed)
    q = _find_rest(stiffness, contacts, closed, rows, k_n, gap, load)
    if q is None:
        raise JointError(FREE)
    approach = rows @ q - gap
    tangential = tuple(item.tangential_stiffness * (item.tangents @ q) * on
                       for item, on in zip(contacts, closed, strict=True))  # fmt: skip
    normal = np.where(closed, k_n * approach, 0.0).clip(min=0)
    return StaticState(
        contacts=tuple(
            replace(item, preload=float(force), gap=0.0 if on else max(float(-distance), 0.0))
            for item, force, distance, on in zip(contacts, normal, approach, closed, strict=True)
        ),
        displacement=q,
        load=load - stiffness @ q,
        normal=normal,
        tangential=tangential,
    )


def _find_rest(
    stiffness: Matrix,
    contacts: Sequence[FrictionContact],
    closed: Bool[NDArray[np.bool_], " c"],
    rows: Matrix,
    k_n: Vector,
    gap: Vector,
    load: Row,
) -> Row | None:
    """Displacement with some contacts closed and stuck; None if they leave a body free."""
    stuck = _stick_closed(stiffness, contacts, closed)
    scale = np.sqrt(np.diag(stuck).clip(min=np.finfo(float).tiny))
    try:
        factor = scipy.linalg.cho_factor(stuck / np.outer(scale, scale), lower=True)
    except np.linalg.LinAlgError:
        factor = None
    if factor is None or (np.diag(factor[0]) ** 2).min() < SINGULAR:
        return None
    pushed = load + rows[closed].T @ (k_n * gap)[closed]
    return np.asarray(scipy.linalg.cho_solve(factor, pushed / scale) / scale)


def _refuse_open(
    lines: Mapping[str, Sequence[str]], contacts: Sequence[FrictionContact], closed: Bool[NDArray[np.bool_], " c"]
) -> None:
    on = {item.name for item, shut in zip(contacts, closed, strict=True) if shut}
    for line, names in lines.items():
        if names and not on & set(names):
            raise JointError(
                f'under the static load "{line}" opens along its whole length, so the body leaves its groove: check '
                "place and inclination of the load, and gaps"
            )


def _compute_size(contact: FrictionContact, force: Vector) -> float:
    """Friction force that is compared with the limit of a contact [N]."""
    if contact.friction is Friction.UNCOUPLED:
        return float(np.abs(force).max(initial=0.0))
    return float(np.linalg.norm(force))


def _toggle_contact(closed: Bool[NDArray[np.bool_], " c"], one: int) -> Bool[NDArray[np.bool_], " c"]:
    result = closed.copy()
    result[one] = not result[one]
    return result


def _stick_closed(
    stiffness: Matrix, contacts: Sequence[FrictionContact], closed: Bool[NDArray[np.bool_], " c"]
) -> Matrix:
    return stuck_stiffness(stiffness, [item for item, on in zip(contacts, closed, strict=True) if on])
