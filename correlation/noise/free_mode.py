r"""Errors of the modes of a structure without its contacts, by a mesh that is too coarse and by all that it leaves out.

With mode shapes of unit modal mass, an error of the stiffness matrix is

.. math:: \delta K = M \Phi\, E\, \Phi^T M, \qquad E_{ii} = 2 e_i\, \omega_i^2, \quad
          E_{ij} = E_{ji} = \sqrt 2\, e_{ij}\, \omega_i \omega_j

Its diagonal moves natural frequencies. What is beside it mixes mode shapes, and an error that knows nothing of the
modes has both: E / (omega_i omega_j) is then a symmetric matrix of normal numbers whose diagonal has twice the variance
of the rest, as that has in any other basis. So one standard deviation serves all e.

References
----------
Soize, A nonparametric model of random uncertainties for reduced matrix models in structural dynamics, Probabilistic
Engineering Mechanics 15 (2000), 277-294: random matrices in modal coordinates; Mehta, Random Matrices (2004), chapter
2: the Gaussian orthogonal ensemble.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.configuration import Tangent
from correlation.model import Model
from hbsolve.model_rates import MatrixParameter, ModelParameter

#: Highest natural frequency whose error is taken, over the highest frequency of the readings: beyond, a mode answers
#: like a spring, and an error e of its frequency changes the reading by less than 2 e / 8 of its small share [-].
REACHED = 3.0
#: The same for modes that mix with those: the share that a mode has in another's shape falls with its frequency alone.
MIXED = 30.0
#: Errors of shapes that are taken, those that change readings most: each costs a solution of every state.
MOST_MIXINGS = 16
#: Smallest of them, and smallest reading by which changes are divided, as shares of the largest [-].
LEAST, FAINT = 1e-3, 1e-2
#: Relative distance of two squared frequencies below which modes mix no more [-].
CLOSE = 0.1


Rows = Float[NDArray[np.float64], "q r"]
Motions = Complex[NDArray[np.complex128], "s r"]
Numbers = Int[NDArray[np.int64], " pair"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeModes:
    """Modes of a structure without its contacts, the lowest one first.

    Parameters
    ----------
    frequency
        omega, shape (n,) [rad/s].
    shapes
        phi of unit modal mass as rows, shape (n, r) [1/sqrt(kg)].
    weighted
        M phi, shape (n, r) [sqrt(kg)].
    """

    frequency: Float[NDArray[np.float64], " n"]
    shapes: Float[NDArray[np.float64], "n r"]
    weighted: Float[NDArray[np.float64], "n r"]

    @classmethod
    def below(cls, model: Model, highest: float) -> "FreeModes":
        """Modes below a frequency, positive [Hz]."""
        mass, most = model.system.mass, (2 * np.pi * highest) ** 2
        # M phi = mu (K + s M) phi with mu = 1 / (omega^2 + s): neither M nor K needs to be regular. A degree of
        # freedom that has neither without its contacts gets round-off.
        shifted = model.system.stiffness + most * mass
        shifted = shifted + np.eye(len(mass)) * (np.finfo(np.float64).eps * np.abs(shifted).max())
        size, shapes = scipy.linalg.eigh(mass, shifted, subset_by_value=(0.5 / most, np.inf))
        size, shapes = size[::-1], shapes[:, ::-1]
        squared = 1 / size - most
        shapes = shapes / np.sqrt(size)
        return cls(frequency=np.sqrt(np.maximum(squared, 0.0)), shapes=shapes.T, weighted=(mass @ shapes).T)

    def frequency_errors(self) -> list[Tangent]:
        """A relative error of each natural frequency.

        An error common to all modes, such as that of Young's modulus, moves no mode against another; a mesh that is too
        coarse does.
        """
        return [
            _tangent(2 * omega**2 * np.outer(row, row))
            for omega, row in zip(self.frequency, self.weighted, strict=True)
        ]

    def shape_errors(self, n_carrying: int, motions: Motions, rows: Rows) -> list[Tangent]:
        """Errors that mix modes which carry the response with all others: those that change readings most.

        An error E_ij gives mode i the share sqrt(2) e_ij omega_i omega_j / (omega_i^2 - omega_j^2) of mode j's shape.
        This maps all e on relative changes of the readings. The combinations of e that change these most are the left
        singular vectors of this map; like e itself, they are independent and of unit variance.

        Parameters
        ----------
        n_carrying
            Number of the modes that carry the response, the lowest ones [-].
        motions
            Of the states, shape (s, r) [m].
        rows
            Of the readings and of the force, shape (q, r) [-].
        """
        i, j = np.triu_indices(len(self.frequency), 1)
        i, j = i[i < n_carrying], j[i < n_carrying]
        read = _root_mean_square(motions @ rows.T)
        if not len(i) or not read.any():
            return []
        product, squared = self.frequency[i] * self.frequency[j], self.frequency**2
        # Two modes of one frequency are any mix of each other already.
        apart = np.maximum(np.abs(squared[i] - squared[j]), CLOSE * product)
        mixed = (np.sqrt(2) * product / np.where(apart > 0, apart, np.inf))[:, None]
        at_rows = (self.shapes @ rows.T) / np.maximum(read, FAINT * read.max())
        carried = _root_mean_square(motions @ self.weighted.T)[:, None]
        changes = np.hstack([mixed * at_rows[j] * carried[i], mixed * at_rows[i] * carried[j]])
        combined, size, _ = np.linalg.svd(changes, full_matrices=False)
        return [
            self._mix(i, j, np.sqrt(2) * product * combined[:, k])
            for k in range(min(MOST_MIXINGS, len(size)))
            if size[k] > LEAST * size[0]
        ]

    def _mix(self, i: Numbers, j: Numbers, entries: Float[NDArray[np.float64], " pair"]) -> Tangent:
        """Change of the stiffness matrix by entries E_ij = E_ji."""
        own = np.zeros((len(self.frequency), len(self.frequency)))
        own[i, j] = own[j, i] = entries
        return _tangent(self.weighted.T @ own @ self.weighted)


NO_MODES = FreeModes(frequency=np.zeros(0), shapes=np.zeros((0, 0)), weighted=np.zeros((0, 0)))


def _root_mean_square(values: NDArray[np.complex128]) -> Float[NDArray[np.float64], " n"]:
    """Of each column."""
    return np.asarray(np.sqrt(np.mean(np.abs(values) ** 2, axis=0)))


def _tangent(stiffness: Float[NDArray[np.float64], "r r"]) -> Tangent:
    rate = ModelParameter(matrices=MatrixParameter(stiffness=stiffness))
    return Tangent(jointed=rate, free=rate, gain={})
