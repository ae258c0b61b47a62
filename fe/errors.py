"""Errors of meshes, supports and matrix files; `geometry.errors` shows the whole tree of errors."""

from geometry.errors import InputError


class MeshError(InputError):
    """Error for a mesh or mesh file that cannot be used."""


class InvertedCell(MeshError):
    """Error for a mesh with at least one inverted cell."""


class PointOffSurface(MeshError):
    """Error for a point that is not on the surface of the mesh.

    Parameters
    ----------
    message
        Message in one sentence.
    number
        Index of the point.
    distance
        Distance from the nearest face [m].
    nearest
        Nearest point of that face, x, y, z [m].
    """

    # The defaults are needed because an error from another process is first constructed from its message.
    def __init__(
        self, message: str, number: int = 0, distance: float = 0.0, nearest: tuple[float, ...] = (0.0, 0.0, 0.0)
    ) -> None:
        super().__init__(message)
        self.number = number
        self.distance = distance
        self.nearest = nearest


class SupportError(InputError):
    """Error for supports that select no node, or leave a rigid-body motion free."""


class UnsupportedBody(SupportError):
    """Error for supports that leave a rigid-body motion of one of several bodies free."""


class MatrixFileError(InputError):
    """Error for a file of sparse matrices, or of their degrees of freedom, that cannot be used."""


class BackendError(InputError):
    """Error for a requested library for sparse matrices that is unknown or not installed."""
