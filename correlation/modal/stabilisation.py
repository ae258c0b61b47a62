r"""Poles of measured frequency responses for increasing order of a common denominator, and the stable ones.

The least-squares complex frequency-domain method fits all responses by :math:`H_c = B_c(z) / A(z)` with polynomials of
:math:`z = e^{-i \theta}`, with theta the frequency scaled to the band. The equation error :math:`A H_c - B_c` is
linear; elimination of the numerators leaves one small eigenvalue problem per order. Modes of the structure appear at
every order, while poles that fit the noise vary.

With complex coefficients and a band that covers most of the circle the equations are well conditioned at any order.

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

#: Share of the circle that the band covers: less than 1, since responses are not periodic in frequency [-].
CIRCLE = 0.9
#: Largest relative difference of frequency and of damping to a pole of the next lower order, for a stable pole [-].
SAME_FREQUENCY, SAME_DAMPING = 2e-3, 0.1
#: Damping ratio above which poles belong to the background [-].
MOST_DAMPING = 0.2
#: Radius of a group of stable poles, as a share of their distance from the imaginary axis [-].
STABLE_DISTANCE = 0.5
#: Least share of the orders at which a mode is stable [-].
MIN_STABLE_SHARE = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class Stabilisation:
    """Stabilisation diagram.

    Parameters
    ----------
    order
        Order at which each pole was found, shape (p,) [-].
    pole
        Poles, shape (p,) [rad/s].
    stable
        Whether the next lower order has the pole too, shape (p,).
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
        """Undamped natural frequencies, shape (p,) [Hz]."""
        return np.asarray(np.abs(self.pole) / (2 * np.pi))

    @property
    def damping_ratio(self) -> Float[NDArray[np.float64], " p"]:
        """Damping ratios, shape (p,) [-]."""
        return np.asarray(-self.pole.real / np.abs(self.pole))


def find_poles(frequency: Frequencies, responses: Responses, highest_order: int) -> Stabilisation:
    """Poles in the band at all orders from 1 to the highest.

    Parameters
    ----------
    frequency
        Frequencies, ascending, evenly spaced or not, shape (f,) [Hz].
    responses
        Responses scaled to similar size, shape (c, f).
    highest_order
        Highest order of the common denominator [-].
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
        # With a constant coefficient of one, spurious poles are unstable and are removed.
        rest = np.linalg.lstsq(reduced[1:, 1:], -reduced[1:, 0], rcond=1e-14)[0]
        roots = np.roots(np.concatenate([rest[::-1], [1.0]]))
        roots = roots[np.abs(roots) > 0]
        exponents = 2 * np.pi * (1j * low - np.log(roots) / turn)
        # Branch of the logarithm: the angle runs from 0 to 2 pi over the circle.
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
    """One pole for every mode that is stable at many orders, in ascending frequency, shape (m,) [rad/s].

    Stable poles are grouped, the group with the most orders first.
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
