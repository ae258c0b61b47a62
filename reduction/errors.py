"""Errors of reduced models; the whole tree is drawn in `geometry.errors`."""

from geometry.errors import InputError


class RomError(InputError):
    """A boundary, a reduced model or its file that cannot be used."""


class JointError(InputError):
    """A joint or a load that describes no structure."""


class MatrixError(InputError):
    """A file of mass, damping and stiffness that describes no structure."""


class ExchangeError(InputError):
    """A structure that another program cannot take, or a file of one that cannot be read."""
