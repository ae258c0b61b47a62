r"""Poles of measured frequency responses over the order of a common denominator, and those among them that are stable.

The least-squares complex frequency-domain method fits all responses by :math:`H_c = B_c(z) / A(z)` with polynomials of
:math:`z = e^{-i \theta}`, theta being the frequency over the band. The equation error :math:`A H_c - B_c` is linear;
its numerators are eliminated, so that one small eigenvalue problem per order is left. Modes of the structure come back
at every order; poles that fit the noise move.

Complex coefficients and a band that covers most of the circle keep the equations well conditioned at any order.

References
----------
Guillaume et al., A poly-reference implementation of the least-squares complex frequency-domain estimator, IMAC 21
(2003).
Peeters et al., The PolyMAX frequency-domain method, Shock and Vibration 11 (2004) 395.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from geometry.read_only_array import freeze_fields

Poles = Complex[NDArray[np.complex128], " p"]
Responses = Complex[NDArray[np.complex128], "c f"]
Frequencies = Float[NDArray[np.float64], " f"]

#: The band covers this share of the circle: less than all, since responses do not close [-].
CIRCLE = 0.9
#: A pole is stable if one of the order below differs by less in frequency, relative, and in damping ratio, relative.
SAME_FREQUENCY, SAME_DAMPING = 2e-3, 0.1
#: Poles with more damping belong to the background [-].
MOST_DAMPING = 0.2
#: Stable poles of one mode lie within this share of their distance from the imaginary axis, and within so much of the
#: band's resolution.
STABLE_DISTANCE = 0.5
#: Share of the orders at which a mode is stable at least [-].
MIN_STABLE_SHARE = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class Stabilisation:
    """Stabilisation diagram.

    Parameters
    ----------
    order
        Order at which each pole was found, shape (p,) [-].
    pole
        Shape (p,) [rad/s].
    stable
        Whether the order below has the pole too, shape (p,).
    """

    order: Int[NDArray[np.int64], " p"]
    pole: Poles
    stable: Bool[NDArray[np.bool_], " p"]

    def __post_init__(self) -> None:
        freeze_fields(self, "order", kind=np.int64)
        freeze_fields(self, "pole", kind=np.complex128)
        freeze_fields(self, "stable", kind=np.bool_)

    @property
    def frequency(self) -> Float[NDArray[np.float64], " p"]:
        """Undamped, shape (p,) [Hz]."""
        return np.asarray(np.abs(self.pole) / (2 * np.pi))

    @property
    def damping_ratio(self) -> Float[NDArray[np.float64], " p"]:
        """Shape (p,) [-]."""
        return np.asarray(-self.pole.real / np.abs(self.pole))


def find_poles(frequency: Frequencies, responses: Responses, highest_order: int) -> Stabilisation:
    """Poles in the band at all orders from 1 to the highest.

    Parameters
    ----------
    frequency
        Rising, evenly spaced or not, shape (f,) [Hz].
    responses
        Each over its own noise, shape (c, f).
    highest_order
        Of the common denominator [-].
    """
    low, high = frequency[0], frequency[-1]
    turn = 2 * np.pi * CIRCLE / (high - low)  # angle per Hz
    basis = np.exp(-1j * turn * np.outer(frequency - low, np.arange(highest_order + 1)))
    normal = np.zeros((highest_order + 1, highest_order + 1), dtype=np.complex128)
    numerator = basis.conj().T @ basis
    products = []
    for response in responses:
        weighted = -response[:, None] * basis
        normal += weighted.conj().T @ weighted
        products.append(basis.conj().T @ weighted)
    orders, poles = [], []
    for order in range(1, highest_order + 1):
        n = order + 1
        inverse = np.linalg.pinv(numerator[:n, :n], hermitian=True, rcond=1e-12)
        reduced = normal[:n, :n] - sum(part[:n, :n].conj().T @ inverse @ part[:n, :n] for part in products)
        # The constant is one: spurious poles are then unstable, and drop out.
        rest = np.linalg.lstsq(reduced[1:, 1:], -reduced[1:, 0], rcond=1e-14)[0]
        roots = np.roots(np.concatenate([rest[::-1], [1.0]]))
        roots = roots[np.abs(roots) > 0]
        exponents = 2 * np.pi * (1j * low - np.log(roots) / turn)
        # The logarithm's branch: the angle runs from 0 to 2 pi over the circle.
        exponents = np.where(exponents.imag < 2 * np.pi * low - np.pi * (1 / CIRCLE - 1) * (high - low),
                         exponents + 2j * np.pi * (high - low) / CIRCLE, exponents)  # fmt: skip
        damping = -exponents.real / np.abs(exponents)
        inside = (exponents.imag > 2 * np.pi * low) & (exponents.imag < 2 * np.pi * high)
        kept = exponents[inside & (damping > 0) & (damping < MOST_DAMPING)]
        orders.append(np.full(len(kept), order))
        poles.append(kept[np.argsort(kept.imag)])
    stable = [np.zeros(len(poles[0]), dtype=bool)]
    for below, here in pairwise(poles):
        stable.append(np.array([_is_stable(pole, below) for pole in here], dtype=bool))
    return Stabilisation(order=np.concatenate(orders), pole=np.concatenate(poles), stable=np.concatenate(stable))


def _is_stable(pole: complex, below: Poles) -> bool:
    if not len(below):
        return False
    size = abs(pole)
    near = np.abs(np.abs(below) - size) < SAME_FREQUENCY * size
    return bool((near & (np.abs(below.real - pole.real) < SAME_DAMPING * abs(pole.real))).any())


def select_modes(diagram: Stabilisation) -> Poles:
    """One pole for every mode that is stable at many orders, by rising frequency, shape (m,) [rad/s].

    Stable poles are grouped, the densest group first; a group has one pole per order at most.
    """
    poles, orders = diagram.pole[diagram.stable], diagram.order[diagram.stable]
    least = max(MIN_STABLE_SHARE * (diagram.order.max() if len(diagram.order) else 0), 3)
    modes = []
    left = np.ones(len(poles), dtype=bool)
    while left.any():
        distance = np.abs(poles[:, None] - poles[None, :])
        near = (distance < STABLE_DISTANCE * np.abs(poles.real)[:, None]) & left[None, :]
        count = np.array([len(set(orders[row])) for row in near]) * left
        best = int(np.argmax(count))
        if count[best] < least:
            break
        members = near[best]
        modes.append(complex(np.median(poles[members].real), np.median(poles[members].imag)))
        left &= ~members
    return np.array(sorted(modes, key=lambda pole: pole.imag), dtype=np.complex128)
