r"""A symmetric matrix as diagonal plus low rank, split by its off-diagonal entries alone.

.. math:: A = \mathrm{diag}(d) + U \, \mathrm{diag}(s) \, U^T

with few columns in U. The off-diagonal entries are those of the second part, and determine it: with the indices in
three sets, the off-diagonal blocks give the diagonal of this part,

.. math:: L_{ii} = A_{iQ} A_{PQ}^{+} A_{Pi}, \qquad i, P, Q \text{ in different sets} .

References
----------
Jolliffe, Principal Component Analysis (2002), section 7.2: factor analysis, the same with noise.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from reduction.array_type import Matrix, Real

#: Largest rank: beyond it a dense solve costs little more.
MAX_RANK = 24
#: Least size of a matrix: two indices in each of three sets.
MIN_MATRIX_SIZE = 6
#: Size of entries that is round-off, relative to sqrt(a_ii a_jj) and to the largest entry.
OWN_ROUND_OFF, ROUND_OFF = 1e-10, 1e-14
#: Seed of the sets, and rounds in which both parts are refined.
SEED, ROUNDS = 0, 8


class DiagonalPlusLowRank(NamedTuple):
    """diag(d) + U diag(s) U^T."""

    diagonal: Float[Real, " r"]
    """d, shape (r,)."""
    directions: Float[Real, "r k"]
    """U, shape (r, k)."""
    strength: Float[Real, " k"]
    """s, shape (k,)."""


def split_diagonal_plus_low_rank(matrix: Matrix) -> DiagonalPlusLowRank | None:
    """Both parts of a symmetric matrix, shape (r, r); None if it has no such parts or too few entries to find them."""
    size = np.abs(np.diag(matrix))
    if not size.all():
        return None
    root = np.sqrt(size)
    scaled = matrix / np.outer(root, root)
    allowed = OWN_ROUND_OFF + ROUND_OFF * np.abs(matrix).max() / np.outer(root, root)
    apart = ~np.eye(len(matrix), dtype=bool)
    if not (apart & (np.abs(scaled) > allowed)).any():
        return DiagonalPlusLowRank(np.diag(matrix).copy(), np.zeros((len(matrix), 0)), np.zeros(0))
    result = _complete(scaled, allowed)
    if result is None:
        return None
    added, count = result
    for _ in range(ROUNDS):
        rest = np.where(apart, scaled, 0.0) + np.diag(added)
        values, vectors = np.linalg.eigh(rest)
        few = np.argsort(-np.abs(values), kind="stable")[:count]
        part = (vectors[:, few] * values[few]) @ vectors[:, few].T
        if not (apart & (np.abs(scaled - part) > allowed)).any():
            diagonal = size * (np.diag(scaled) - np.diag(part))
            return DiagonalPlusLowRank(diagonal, root[:, None] * vectors[:, few], values[few])
        added = np.diag(part).copy()
    return None


def _complete(scaled: Matrix, allowed: Matrix) -> tuple[Float[Real, " r"], int] | None:
    """Diagonal of the part of low rank, and its rank; None if the rank is too high."""
    r = len(scaled)
    if r < MIN_MATRIX_SIZE:
        return None
    sets = [part.astype(np.int64) for part in np.array_split(np.random.default_rng(SEED).permutation(r), 3)]
    added, count = np.zeros(r), 0
    for own, other, third in (sets, (sets[1], sets[2], sets[0]), (sets[2], sets[0], sets[1])):
        block = scaled[np.ix_(third, other)]
        left, values, right = np.linalg.svd(block, full_matrices=False)
        noise = allowed[np.ix_(third, other)].max() * np.sqrt(max(block.shape))
        rank = int((values > noise).sum())
        if rank > MAX_RANK or 2 * rank > len(values):
            return None
        inverse = (right[:rank].T / values[:rank]) @ left[:, :rank].T
        added[own] = np.einsum("iq,qp,pi->i", scaled[np.ix_(own, other)], inverse, scaled[np.ix_(third, own)])
        count = max(count, rank)
    return added, count
