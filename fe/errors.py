"""What can be wrong with a mesh or its supports; the whole tree is drawn in `geometry.errors`."""

from geometry.errors import InputError


class MeshError(InputError):
    """A mesh, or a mesh file, that cannot be used."""


class InvertedCell(MeshError):
    """At least one cell is turned inside out."""


class SupportError(InputError):
    """Supports that name nothing, or leave a rigid-body motion free."""


class MatrixFileError(InputError):
    """A file of sparse matrices, or of their degrees of freedom, that cannot be used."""


class BackendError(InputError):
    """A library for sparse matrices that was asked for and is not installed."""
