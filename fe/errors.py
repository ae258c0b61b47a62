"""Errors of meshes, supports and matrix files; the whole tree is drawn in `geometry.errors`."""

from geometry.errors import InputError


class MeshError(InputError):
    """A mesh, or a mesh file, that cannot be used."""


class InvertedCell(MeshError):
    """At least one cell is turned inside out."""


class PointOffSurface(MeshError):
    """A place that is not on the surface of the mesh.

    Parameters
    ----------
    message
        One sentence.
    number
        Index of the place.
    distance
        From the nearest face [m].
    nearest
        Point of that face, x, y, z [m].
    """

    # Defaults, since an error that comes back from another process is made of its message first.
    def __init__(
        self, message: str, number: int = 0, distance: float = 0.0, nearest: tuple[float, ...] = (0.0, 0.0, 0.0)
    ) -> None:
        super().__init__(message)
        self.number = number
        self.distance = distance
        self.nearest = nearest


class SupportError(InputError):
    """Supports that name nothing, or leave a rigid-body motion free."""


class UnsupportedBody(SupportError):
    """Supports that leave one of several bodies a rigid-body motion."""


class MatrixFileError(InputError):
    """A file of sparse matrices, or of their degrees of freedom, that cannot be used."""


class BackendError(InputError):
    """A library for sparse matrices that was asked for and is not installed."""
