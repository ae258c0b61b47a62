r"""Basis functions of a free-form force law, and their forces along a motion.

.. math:: f = k \frac{u}{R} + g_-(u) + g_+(u) + c \frac{v}{V} + h(v) + \sum_j w_j\, m_j[u], \qquad w_j \ge 0

R and V are the largest displacement and velocity. g_- is odd, g_+ even, h odd; all are piecewise linear. Their prior is
an integrated Wiener process, which is that of a cubic smoothing spline (Wahba 1978): the change of slope is equally
likely everywhere. Values and slopes are zero at zero, where k and c represent the slope. A kernel with the eigenvalues
l_i and the eigenvectors q_i gives the functions sqrt(l_i) q_i, whose coefficients are independent with equal variance.
m_j is the force of a Jenkins cell that slides at the displacement d_j, over its limit. All coefficients are forces.

References
----------
Wahba, Improper priors, spline smoothing and the problem of guarding against model errors in regression, J. R. Stat.
Soc. B 40 (1978). Segalman, A four-parameter Iwan model for lap-type joints, J. Appl. Mech. 72 (2005).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

#: Number of linear pieces from zero to the largest displacement or velocity [-].
N_PIECE = 12
#: Share of the largest eigenvalue of the kernel below which a function is left out [-].
NEGLIGIBLE = 1e-6
#: Displacements at which the cells slide, over the largest one: a cell that slides earlier acts as Coulomb friction,
#: one that slides later as a spring.
SLIDES = tuple(np.geomspace(0.02, 0.75, 7).tolist())
#: Groups of coefficients in their order; each group has its own prior variance.
GROUPS = ("stiffness", "odd spring", "even spring", "damping", "odd damper", "memory")
#: Number of the group of even forces.
EVEN = GROUPS.index("even spring")
#: Number of instants of a period.
N_INSTANT = 128

Samples = Float[NDArray[np.float64], "s n"]


@dataclass(frozen=True, kw_only=True)
class LawBasis:
    """Basis functions of a law over a range.

    Parameters
    ----------
    reach
        Largest displacement R [m], or angle [rad].
    speed
        Largest velocity V [m/s].
    """

    reach: float
    speed: float

    @cached_property
    def curved(self) -> Float[NDArray[np.float64], "p c"]:
        """Values of the basis functions of g_-, g_+ and h at 1/p, 2/p, ..., 1 of the range, shape (p, c) [-]."""
        x = np.arange(1, N_PIECE + 1) / N_PIECE
        low, high = np.minimum.outer(x, x), np.maximum.outer(x, x)
        # Covariance kernel with variance 1 at the end of the range.
        size, turn = np.linalg.eigh(low**2 * (3 * high - low) / 2)
        kept = size > NEGLIGIBLE * size[-1]
        return np.asarray((turn * np.sqrt(np.maximum(size, 0.0)))[:, kept][:, ::-1])

    @cached_property
    def group(self) -> Int[NDArray[np.int64], " b"]:
        """Number in `GROUPS` of each coefficient, shape (b,)."""
        c = self.curved.shape[1]
        return np.repeat(np.arange(len(GROUPS)), [1, c, c, 1, c, len(SLIDES)])

    @property
    def width(self) -> float:
        """Width of a linear piece of the springs [m]."""
        return self.reach / N_PIECE

    @property
    def width_of_speed(self) -> float:
        """Width of a linear piece of the damper [m/s]."""
        return self.speed / N_PIECE

    @property
    def is_positive(self) -> NDArray[np.bool_]:
        """Mask of the coefficients that must not be negative, shape (b,)."""
        return np.asarray(self.group == GROUPS.index("memory"))

    def forces(self, u: Samples, v: Samples) -> Float[NDArray[np.float64], "s n b"]:
        """Force of each function with the coefficient 1 along periodic motions, shape (s, n, b) [-].

        Parameters
        ----------
        u, v
            Displacement and velocity at n instants of a period of s motions, shape (s, n) [m, m/s].
        """
        x, y = u / self.reach, v / self.speed
        over_x, over_y = self._tabulated(np.abs(x)), self._tabulated(np.abs(y))
        return np.concatenate(
            [
                x[..., None],
                np.sign(x)[..., None] * over_x,
                over_x,
                y[..., None],
                np.sign(y)[..., None] * over_y,
                _slide(x),
            ],
            axis=-1,
        )

    def pieces(
        self, coefficients: Float[NDArray[np.float64], " b"]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Change of slope at 0, 1/p, 2/p, ... of the range, for u > 0, u < 0 and v > 0, shape (p,) each.

        In N/m, N/m and N s/m; the slope for u < 0 is that of -f with respect to -u.
        """
        k, odd, even, c, damper, _ = (coefficients[self.group == number] for number in range(len(GROUPS)))
        ahead = self._changes(k, odd + even)
        back = self._changes(k, odd - even)
        return ahead / self.reach, back / self.reach, self._changes(c, damper) / self.speed

    def cells(self, coefficients: Float[NDArray[np.float64], " b"]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stiffness [N/m] and limit force [N] of each Jenkins cell, shape (cells,)."""
        limit = coefficients[self.is_positive]
        return limit / (np.array(SLIDES) * self.reach), limit

    def _changes(self, linear: NDArray[np.float64], curved: NDArray[np.float64]) -> NDArray[np.float64]:
        values = np.concatenate([[0.0], self.curved @ curved])
        slopes = np.diff(values) * N_PIECE + linear[0]
        return np.asarray(np.diff(slopes, prepend=0.0))

    def _tabulated(self, x: Samples) -> Float[NDArray[np.float64], "s n c"]:
        """Functions `curved` at x >= 0 in units of the range; they are extrapolated linearly beyond it."""
        piece = np.minimum((x * N_PIECE).astype(np.int64), N_PIECE - 1)
        values = np.vstack([np.zeros(self.curved.shape[1]), self.curved])
        share = (x * N_PIECE - piece)[..., None]
        return np.asarray(values[piece] * (1 - share) + values[piece + 1] * share)


def follow(
    coefficients: Complex[NDArray[np.complex128], "s h"], angular_frequency: Float[NDArray[np.float64], " s"]
) -> tuple[Samples, Samples]:
    """Displacement and velocity of motions at the instants of a period, shape (s, n) [m, m/s]."""
    h = np.arange(coefficients.shape[1])
    turn = np.exp(2j * np.pi * np.outer(h, np.arange(N_INSTANT)) / N_INSTANT)
    velocity = coefficients * (1j * h * angular_frequency[:, None])
    return (coefficients @ turn).real, (velocity @ turn).real


def find_harmonics(forces: Float[NDArray[np.float64], "s n b"], count: int) -> Complex[NDArray[np.complex128], "s h b"]:
    """Harmonics 0, 1, ... of forces sampled over a period, peak amplitudes, shape (s, h, b) [N]."""
    parts = np.fft.rfft(forces, axis=1)[:, :count] * (2.0 / forces.shape[1])
    parts[:, 0] /= 2
    return np.asarray(parts)


def _slide(x: Samples) -> Float[NDArray[np.float64], "s n j"]:
    """Forces of Jenkins cells over their limits along periodic motions; the second period is periodic."""
    slides = np.array(SLIDES)
    n = x.shape[1]
    force, before = np.zeros((len(x), len(slides))), x[:, -1]
    result = np.zeros((len(x), n, len(slides)))
    for number in range(2 * n):
        now = x[:, number % n]
        force = np.clip(force + ((now - before)[:, None]) / slides, -1.0, 1.0)
        result[:, number % n], before = force, now
    return result
