r"""Static equilibrium, the state from which an integration starts unless another is given.

With the positions u = B q of the joints, their forces f, and the stiffness K_s = K + B^T k_0 B of the structure with
closed, sticking joints k_0,

.. math:: u = B K_s^{-1} f_\mathrm{static} - G\,(f(u) - k_0 u), \qquad G = B K_s^{-1} B^T

is first tried with all of the load at once: where no joint slips, that is the answer. Else the load is put on in parts.
Where Newton's method finds no equilibrium of a part, as after a jump, pseudo-transient continuation does, by implicit
steps of

.. math:: M \dot q = f_\mathrm{static} - K q - B^T f

that grow until the structure is at rest. Friction has no potential that could be minimised instead, but a short step
always has one solution, since M outweighs the joints in it.

References
----------
Kelley and Keyes, Convergence analysis of pseudo-transient continuation, SIAM Journal on Numerical Analysis 35 (1998).
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from reduction.array_type import Vector
from reduction.jointed_system import JointedSystem
from transient.errors import TransientError
from transient.joint_forces import joint_forces
from transient.state import TransientState
from transient.state_transition import ModalStructure, make_modal_structure, modes
from transient.time_steps import StepEquation, solve_positions

#: Equal parts in which the load is put on, so that sliders move as on a slow ramp.
N_PART = 50

#: Eigenvalues below this share of the largest are rigid-body motion.
RIGID = 1e-12

#: Sliders that are off by less than this share of the positions, or of the sums they come from, have not slipped.
STUCK = 1e-10

#: Pseudo-transient steps at most, and the growth of their length after one that succeeds and one that fails.
N_PSEUDO_STEP = 400
LONGER, SHORTER = 2.0, 0.125
#: Length of a step, in the slowest time constant, from which on the equilibrium itself is tried again.
LONG_STEP = 100.0


def equilibrium(system: JointedSystem | ModalStructure, load: float = 1.0) -> TransientState:
    """State at rest under the static load, sliders at 0 before.

    If no joint slips under all of the load at once, sliders stay at 0; else the load is put on in equal parts on the
    preloaded joints. Which modes a `ModalStructure` has does not matter.

    Parameters
    ----------
    system
        Structure, joints and loads, or its modal structure.
    load
        Scale of the static load [-].

    Raises
    ------
    TransientError
        A body that neither a support nor a sticking joint fixes, or no equilibrium found.
    """
    search = _Search(make_modal_structure(system), load)
    return search.follow_load(
        [] if not search.loaded or search.solve_without_slip() else [n / N_PART for n in range(1, N_PART + 1)]
    )


def find_quasi_static_state(
    system: JointedSystem | ModalStructure, loads: Sequence[float], slider: Vector | None = None
) -> TransientState:
    """State at rest after the static load has gone slowly from one share to the next, each way in equal parts.

    Parameters
    ----------
    system
        Structure, joints and loads, or its modal structure.
    loads
        Shares of the static load in their order, at least one, such as (1.3, 0.8, 1.0) [-]; the first is reached from
        nothing, or from 1 where sliders are given.
    slider
        Positions where a rest under the whole load has left the sliders, shape (s,) [m].

    Raises
    ------
    TransientError
        As `equilibrium`.
    """
    search = _Search(make_modal_structure(system), 1.0)
    ramps = [np.linspace(before, after, N_PART + 1)[1:] for before, after in pairwise((0.0, *loads))]
    if slider is not None:
        search.slider = np.array(slider, dtype=np.float64)
        # The rest that left them there is found at once.
        ramps[0] = np.append(1.0, np.linspace(1.0, loads[0], N_PART + 1)[1:])
    return search.follow_load(np.concatenate([np.zeros(0), *ramps]).tolist())


class _Search:
    """State of a search for an equilibrium: modal displacements with sticking joints, positions, sliders."""

    def __init__(self, structure: ModalStructure, load: float) -> None:
        self._table = table = structure.table
        # Sticking joints whatever modes were given: what large contact forces leave of each other would be lost in the
        # round-off of the soft modes without joints.
        self._offset = table.stuck_stiffness
        if np.array_equal(structure.offset, self._offset):
            self._eigenvalue, self.shapes = structure.eigenvalue, structure.mode_shapes
        else:
            self._eigenvalue, self.shapes = modes(structure.system, table, self._offset)
        self._rows = np.ascontiguousarray(table.rows @ self.shapes)
        self._static = load * (self.shapes.T @ structure.system.static)
        d = len(table.rows)
        self.modal, self.slider = np.zeros(len(self.shapes)), np.zeros(table.n_slider)
        self._position, self._inverse = np.zeros(d), np.eye(d)
        self._at_rest, zero = np.zeros(d), np.zeros(d)
        joint_forces(table.packed, zero, zero, self.slider, 1.0, zero.copy(), self._at_rest, self.slider.copy())
        self._terms = np.where(self._at_rest > 0, table.normal_terms, 0.0)
        self.loaded = bool(structure.system.static.any() or self._at_rest.any())
        lowest, highest = float(self._eigenvalue.min()), float(self._eigenvalue.max())
        if self.loaded and not lowest > RIGID * highest:
            raise TransientError(
                f"the structure with its joints stuck has the eigenvalue {lowest:g} 1/s^2, so a body is not "
                "supported: support it or give a start"
            )
        self._lowest, self._scale = lowest, 0.0

    def follow_load(self, shares: Sequence[float]) -> TransientState:
        """Follow the load through these shares of itself, and return the state at rest after the last one."""
        for share in shares:
            if not (self.solve_step(share) or self.solve_by_pseudo_transient(share)):
                raise TransientError(
                    f"no equilibrium was found at {100 * share:.0f} % of the static load: give a start, for instance "
                    "from a slow ramp (`transient.history`)"
                )
        return TransientState(
            displacement=self.shapes @ self.modal, velocity=np.zeros(len(self.shapes)), slider=self.slider
        )

    def solve_without_slip(self) -> bool:
        """Apply all of the load at once, and return whether no slider moves; else the state stays as it was."""
        linear = (self._rows / self._eigenvalue) @ (self._static - self._rows.T @ self._at_rest)
        start = self.modal, self._position, self.slider
        if self.solve_step(1.0, guess=linear):
            size = np.abs(self._position).max(initial=self._scale)
            if np.abs(self.slider).max(initial=0.0) <= STUCK * size:
                self.slider = np.zeros_like(self.slider)
                return True
            self.modal, self._position, self.slider = start
        self._inverse = np.eye(len(self._rows))
        return False

    def solve_step(self, share: float, rate: float = 0.0, guess: Vector | None = None) -> bool:
        """Solve for the equilibrium under a share of the load, or for a pseudo-transient step 1 / rate [s^2]."""
        eigenvalue = self._eigenvalue + rate
        load = share * self._static + rate * self.modal
        flexibility = np.ascontiguousarray((self._rows / eigenvalue) @ self._rows.T)
        free = self._rows @ (load / eigenvalue)
        d = len(free)
        # Positions are found within round-off of what they are sums of, be the sums themselves 0.
        self._scale = float(np.abs(np.concatenate([free, np.abs(flexibility) @ self._terms])).max(initial=0.0))
        force, mean, end, moved = np.zeros(d), np.zeros(d), np.zeros(d), self.slider.copy()
        after = self._position.copy() if guess is None else guess
        equation = StepEquation(
            free, flexibility, self._offset, True, self._position, self.slider, self._table.packed, np.inf,
            force, mean, end, moved,
        )  # fmt: skip
        done = solve_positions(after, equation, self._scale, self._inverse) if d else 0
        if done < 0:
            return False
        self.modal = (load - self._rows.T @ force) / eigenvalue
        self._position, self.slider = after, moved
        return True

    def solve_by_pseudo_transient(self, share: float) -> bool:
        """Solve for an equilibrium under a share of the load by pseudo-transient continuation."""
        rate = self._lowest
        for _ in range(N_PSEUDO_STEP):
            self._inverse = np.eye(len(self._rows))
            if not self.solve_step(share, rate):
                rate /= SHORTER
            elif rate * LONG_STEP < self._lowest:
                if self.solve_step(share):
                    return True
                rate = self._lowest
            else:
                rate /= LONGER
        return False
