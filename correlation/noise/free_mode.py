r"""Errors of the modes of a structure without its contacts, by a coarse mesh and by neglected details.

With mode shapes of unit modal mass, an error of the stiffness matrix is

.. math:: \delta K = M \Phi\, E\, \Phi^T M, \qquad E_{ii} = 2 e_i\, \omega_i^2, \quad
          E_{ij} = E_{ji} = \sqrt 2\, e_{ij}\, \omega_i \omega_j

The diagonal of E shifts natural frequencies; the off-diagonal entries mix mode shapes. A random error that is
independent of the modal basis has both: E / (omega_i omega_j) is then a symmetric matrix of normal variables whose
diagonal has twice the variance of the other entries, in any basis. All e therefore have the same standard deviation.

References
----------
Soize, A nonparametric model of random uncertainties for reduced matrix models in structural dynamics, Probabilistic
Engineering Mechanics 15 (2000), 277-294: random matrices in modal coordinates; Mehta, Random Matrices (2004), chapter
2: the Gaussian orthogonal ensemble.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.model import Model
from correlation.model_solver import Tangent
from hbsolve.model_rates import MatrixParameter, ModelParameter
from reduction.jointed_system import JointedSystem

#: Highest natural frequency with an error, over the highest frequency of the readings. Above it a mode responds
#: quasi-statically, and an error e of its frequency changes the reading by less than 2 e / 8 of its small share [-].
REACHED = 3.0
#: The same for modes that mix with these: the share of a mode in the shape of another one decreases only with its
#: frequency [-].
MIXED = 30.0
#: Squared frequency of rigid-body modes, as a share of the highest squared frequency [-].
RIGID = 1e-9
#: Largest number of shape errors, those that change readings most; each costs a solution of every state.
MOST_MIXINGS = 16
#: Smallest shape error over the largest one, and smallest reading by which changes are divided, over the largest of its
#: kind in a state [-].
LEAST, FAINT = 1e-3, 1e-2
#: Largest number of states at which shape errors are compared; more states give no more information.
MOST_STATES = 24
#: Relative distance of two squared frequencies below which the mixing of modes is limited [-].
MIN_MIXING_DISTANCE = 0.1

#: Rows over the degrees of freedom; motions of states; indices of modes, one for each pair.
Rows = Float[NDArray[np.float64], "q r"]
Motions = Complex[NDArray[np.complex128], "s r"]
Numbers = Int[NDArray[np.int64], " pair"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeModes:
    """Modes of a structure without its contacts, lowest first.

    Parameters
    ----------
    frequency
        omega, shape (n,) [rad/s].
    shapes
        phi of unit modal mass as rows, shape (n, r) [1/sqrt(kg)].
    weighted
        M phi, shape (n, r) [sqrt(kg)].
    n_reached
        Number of modes below `REACHED` times the highest frequency of the readings [-].
    """

    frequency: Float[NDArray[np.float64], " n"]
    shapes: Float[NDArray[np.float64], "n r"]
    weighted: Float[NDArray[np.float64], "n r"]
    n_reached: int

    @classmethod
    def below(cls, model: Model, highest: float) -> "FreeModes":
        """Modes below `MIXED` times the highest frequency of the readings, positive [Hz]."""
        mass, most = model.system.mass, (2 * np.pi * MIXED * highest) ** 2
        # M phi = mu (K + s M) phi with mu = 1 / (omega^2 + s): neither M nor K needs to be regular. A degree of
        # freedom without mass and stiffness gets a stiffness of the size of round-off.
        shifted = model.system.stiffness + most * mass
        shifted = shifted + np.eye(len(mass)) * (np.finfo(np.float64).eps * np.abs(shifted).max())
        size, shapes = scipy.linalg.eigh(mass, shifted, subset_by_value=(0.5 / most, np.inf))
        size, shapes = size[::-1], shapes[:, ::-1]
        squared, shapes = 1 / size - most, shapes / np.sqrt(size)
        frequency = np.sqrt(np.where(squared > RIGID * most, squared, 0.0))
        reached = int(np.count_nonzero(frequency < 2 * np.pi * REACHED * highest))
        return cls(frequency=frequency, shapes=shapes.T, weighted=(mass @ shapes).T, n_reached=reached)

    def frequency_errors(self) -> list[Tangent]:
        """A relative error of each natural frequency below `REACHED`.

        An error common to all modes, such as that of Young's modulus, preserves the ratios of frequencies; a coarse
        mesh changes them.
        """
        return [
            _make_tangent(MatrixParameter(stiffness=2 * omega**2 * np.outer(row, row)))
            for omega, row in zip(self.frequency[: self.n_reached], self.weighted, strict=False)
        ]

    def damping_errors(self, system: JointedSystem) -> list[Tangent]:
        """A relative error of the damping of each mode below `REACHED`, viscous and structural.

        Equal errors of all modes, as with damping proportional to the matrices, are a property of models rather than of
        structures.
        """
        damping, loss = system.damping, system.structural_damping
        result = []
        for shape, row in zip(self.shapes[: self.n_reached], self.weighted, strict=False):
            along = np.outer(row, row)
            lost = None if loss is None else float(shape @ loss @ shape) * along
            result.append(
                _make_tangent(MatrixParameter(damping=float(shape @ damping @ shape) * along, structural_damping=lost))
            )
        return result

    def shape_errors(self, motions: Motions, kinds: Sequence[Rows]) -> list[Tangent]:
        """Errors that mix the modes below `REACHED` with all others: those that change readings most.

        An error E_ij adds the share sqrt(2) e_ij omega_i omega_j / (omega_i^2 - omega_j^2) of shape j to shape i. This
        defines a linear map from e to the relative changes of the readings in each state. Its right singular vectors
        are the combinations of e that change readings most; like e they are independent and of unit variance.

        Parameters
        ----------
        motions
            Motions of the states, shape (s, r) [m].
        kinds
            Rows of the readings and of the force, by kind, shape (q, r) [-].
        """
        i, j = np.triu_indices(len(self.frequency), 1)
        i, j = i[i < self.n_reached], j[i < self.n_reached]
        if not len(i) or not len(motions):
            return []
        motions = motions[np.unique(np.linspace(0, len(motions) - 1, MOST_STATES).round().astype(int))]
        product, squared = self.frequency[i] * self.frequency[j], self.frequency**2
        # Modes of equal frequency are arbitrary combinations of each other: limit their mixing.
        apart = squared[i] - squared[j]
        apart = np.where(np.abs(apart) > MIN_MIXING_DISTANCE * product, apart, -MIN_MIXING_DISTANCE * product)
        mixed = np.sqrt(2) * product / np.where(product > 0, apart, np.inf)
        carried, blocks = motions @ self.weighted.T, []
        for rows in kinds:
            read = np.abs(motions @ rows.T)
            read = np.maximum(read, FAINT * read.max(axis=1, keepdims=True, initial=0.0))[:, :, None]
            shapes = rows @ self.shapes.T
            changes = carried[:, None, i] * shapes[None, :, j] - carried[:, None, j] * shapes[None, :, i]
            blocks.append((mixed * changes / np.where(read > 0, read, np.inf)).reshape(-1, len(i)))
        relative = np.vstack(blocks)
        return [
            self._mix(i, j, np.sqrt(2) * product * combination)
            for combination in _find_principal_combinations(np.vstack([relative.real, relative.imag]))
        ]

    def _mix(self, i: Numbers, j: Numbers, entries: Float[NDArray[np.float64], " pair"]) -> Tangent:
        """Change of the stiffness matrix by entries E_ij = E_ji."""
        own = np.zeros((len(self.frequency), len(self.frequency)))
        own[i, j] = own[j, i] = entries
        return _make_tangent(MatrixParameter(stiffness=self.weighted.T @ own @ self.weighted))


def _find_principal_combinations(changes: Float[NDArray[np.float64], "m pair"]) -> Float[NDArray[np.float64], "k pair"]:
    """Right singular vectors of the largest singular values, from the smaller Gram matrix."""
    wide = changes.shape[1] > len(changes)
    gram = changes @ changes.T if wide else changes.T @ changes
    first = max(len(gram) - MOST_MIXINGS, 0)
    size, vectors = scipy.linalg.eigh(gram, subset_by_index=(first, len(gram) - 1))
    kept = size > LEAST**2 * size[-1]
    if not wide:
        return np.asarray(vectors.T[kept][::-1])
    return np.asarray((vectors.T[kept] @ changes / np.sqrt(size[kept])[:, None])[::-1])


def _make_tangent(matrices: MatrixParameter) -> Tangent:
    """A change of the structure, with its contacts and without."""
    rate = ModelParameter(matrices=matrices)
    return Tangent(jointed=rate, free=rate, gain={})
