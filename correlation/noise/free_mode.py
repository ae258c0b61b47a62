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
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.configuration import Tangent
from correlation.model import Model
from correlation.prediction import Prediction
from hbsolve.model_rates import MatrixParameter, ModelParameter

#: Highest natural frequency whose error is taken, over the highest frequency of the readings: beyond, a mode answers
#: like a spring, and an error e of its frequency changes the reading by less than 2 e / 8 of its small share [-].
REACHED = 3.0
#: Pairs of modes whose mixing is taken: each costs a solution of every state, and the first few mix most.
MOST_PAIRS = 16
#: Relative distance of two squared frequencies below which modes mix no more [-].
CLOSE = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeModes:
    """Modes of a structure without its contacts, the lowest one first.

    Parameters
    ----------
    frequency
        omega, shape (n,) [rad/s].
    weighted
        M phi of unit modal mass as rows, shape (n, r) [sqrt(kg)].
    """

    frequency: Float[NDArray[np.float64], " n"]
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
        return cls(frequency=np.sqrt(np.maximum(squared, 0.0)), weighted=(mass @ shapes).T / np.sqrt(size)[:, None])

    def frequency_errors(self) -> list[Tangent]:
        """A relative error of each natural frequency.

        An error common to all modes, such as that of Young's modulus, moves no mode against another; a mesh that is too
        coarse does.
        """
        return [
            _tangent(2 * omega**2 * np.outer(row, row))
            for omega, row in zip(self.frequency, self.weighted, strict=True)
        ]

    def shape_errors(self, prediction: Prediction) -> list[Tangent]:
        """Errors that mix the modes that carry the response with others, those that mix most."""
        return [
            _tangent(
                np.sqrt(2)
                * self.frequency[i]
                * self.frequency[j]
                * (np.outer(self.weighted[i], self.weighted[j]) + np.outer(self.weighted[j], self.weighted[i]))
            )
            for i, j in self._find_pairs(prediction)
        ]

    def _find_pairs(self, prediction: Prediction) -> list[tuple[int, int]]:
        """Numbers of the modes that mix most: of their shares of the states, and of each other's motion at them.

        An error E_ij gives mode i the share omega_i omega_j / (omega_i^2 - omega_j^2) of mode j's motion.
        """
        n = len(self.frequency)
        if n < 2:
            return []
        share, (i, j) = self._compute_shares(prediction), np.triu_indices(n, 1)
        squared, product = self.frequency**2, self.frequency[i] * self.frequency[j]
        # Two modes of one frequency are any mix of each other already.
        apart = np.maximum(np.abs(squared[i] - squared[j]), CLOSE * product)
        mixed = (share[i] + share[j]) * (product / np.where(apart > 0, apart, np.inf)) ** 2
        order = np.argsort(-mixed, kind="stable")[:MOST_PAIRS]
        return [(int(i[pair]), int(j[pair])) for pair in order if mixed[pair] > 0]

    def _compute_shares(self, prediction: Prediction) -> Float[NDArray[np.float64], " n"]:
        """Share of each mode in the strain energy of the states, each state counting alike, shape (n,)."""
        motions = [state.coefficients[1] for state in prediction.states.values()]
        if not motions:
            return np.zeros(len(self.frequency))
        energy = np.abs(self.frequency * (np.array(motions) @ self.weighted.T)) ** 2
        sums = energy.sum(axis=1, keepdims=True)
        return np.asarray((energy / np.where(sums > 0, sums, 1.0)).mean(axis=0))


NO_MODES = FreeModes(frequency=np.zeros(0), weighted=np.zeros((0, 0)))


def _tangent(stiffness: Float[NDArray[np.float64], "r r"]) -> Tangent:
    rate = ModelParameter(matrices=MatrixParameter(stiffness=stiffness))
    return Tangent(jointed=rate, free=rate, gain={})
