"""Errors of reduced models; `geometry.errors` shows the whole tree of errors."""

from geometry.errors import InputError


class RomError(InputError):
    """Error for a boundary, a reduced model or its file that cannot be used."""


class JointError(InputError):
    """Error for an invalid joint, structure or load."""


class MatrixError(InputError):
    """Error for an invalid file of mass, damping and stiffness."""


class ExchangeError(InputError):
    """Error for a structure that cannot be exported to another program, or a file that cannot be read or written."""
