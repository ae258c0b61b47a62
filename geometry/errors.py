"""What can be wrong with an input, as one tree of exceptions.

::

    ValueError
    └── InputError            the user can mend it: one sentence with the value and the remedy
        ├── GeometryError     a dimension or a shape that cannot be built
        ├── fe.errors.MeshError
        │   └── fe.errors.InvertedCell
        ├── fe.errors.SupportError
        ├── reduction.errors.{RomError, JointError, MatrixError}
        ├── hbsolve.errors.{ForceError, ModelError, PeakError, BalanceError}
        ├── transient.errors.TransientError
        │   └── transient.errors.StepError
        └── study.errors.{CaseError, OutputError, MissingSoftware}

It lives in the lowest room, so that every other room can derive from it.
"""


class InputError(ValueError):
    """An input that its user can mend; the message is one sentence that names the value and the remedy."""


class GeometryError(InputError):
    """A dimension, or a set of dimensions, that describes no solid."""
