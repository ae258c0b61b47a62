"""Displacements of a structure that no place follows: effects may act there as well."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import TRANSLATIONS, Model

Row = Float[NDArray[np.float64], " r"]

#: Size of round-off, relative to the root of both diagonal entries [-].
ROUND_OFF = 1e-10


def list_unnamed_places(model: Model) -> Mapping[str, Row]:
    """Rows of the displacements that are no place, by names such as "node 8 z", "blade node 8 z" or "dof 7".

    Where none is described, degrees of freedom are those of points if the mass matrix is diagonal and the stiffness
    matrix is not; they may be coordinates of modes otherwise.

    Parameters
    ----------
    model
        Model with its places.
    """
    known = any(dof.direction != "modal" for dof in model.dofs)
    lumped = not known and _is_diagonal(model.system.mass) and not _is_diagonal(model.system.stiffness)
    directions = ("modal",) if lumped else TRANSLATIONS
    named = {int(np.argmax(np.abs(row))) for row in model.places.values() if np.count_nonzero(row) == 1}
    several = len({dof.body for dof in model.dofs}) > 1
    result: dict[str, Row] = {}
    for number, dof in enumerate(model.dofs):
        if number in named or dof.direction not in directions:
            continue
        node = f"{f'{dof.body} ' if several else ''}node {dof.node} {dof.direction}"
        row = np.zeros(model.system.n_dof)
        row[number] = 1.0
        result[f"dof {number}" if dof.direction == "modal" else node] = row
    return result


def _is_diagonal(matrix: NDArray[np.float64]) -> bool:
    """Whether all off-diagonal entries are round-off."""
    root = np.sqrt(np.abs(np.diag(matrix)))
    beside = np.abs(matrix - np.diag(np.diag(matrix)))
    return bool((beside <= ROUND_OFF * np.outer(root, root)).all())
