"""Errors of inputs as one tree of exceptions, and doubtful inputs as one tree of warnings.

::

    ValueError
    └── InputError            the user can correct it: one sentence with the value and the remedy
        ├── GeometryError     a dimension or a shape that cannot be built
        ├── SelectorError     a selector that means no face, or one that another has
        ├── RegistryError     a plug-in that fails, lacks a fact or has a name that is taken, or an unknown name
        ├── fe.errors.MeshError
        │   ├── fe.errors.InvertedCell
        │   └── fe.errors.PointOffSurface
        ├── fe.errors.SupportError
        │   └── fe.errors.UnsupportedBody
        ├── fe.errors.{MatrixFileError, BackendError}
        ├── reduction.errors.{RomError, JointError, MatrixError, ExchangeError}
        ├── hbsolve.errors.{ForceError, ModelError, PeakError, BalanceError}
        ├── transient.errors.TransientError
        │   └── transient.errors.StepError
        ├── casefile.errors.CaseError
        ├── OutputError       a folder or file that cannot be written
        └── MissingSoftware   a system library or a package that this machine lacks

    RuntimeError
    └── ComputationFailed     the input is sound, but no result came out

    UserWarning
    └── InputWarning          the input is taken as it is, but may not be meant
        └── hbsolve.errors.DampingWarning

It is in the lowest package, so that every other package can derive from it.
"""

import re

#: Longest run of characters without a blank in a message, as a path may have; a damaged value may have thousands.
LONGEST_WORD = 500
_LONG_WORD = re.compile(rf"\S{{{LONGEST_WORD},}}")


def make_printable(text: str) -> str:
    """Text of a file as a terminal may show it: no control characters, and no endless words."""
    short = _LONG_WORD.sub(lambda word: f"{word[0][:LONGEST_WORD]}...", text)
    return "".join(letter if letter.isprintable() or letter == "\n" else "·" for letter in short)


class InputError(ValueError):
    """An input that its user can correct; the message is one sentence that names the value and the remedy.

    Values come from files: what is not printable in them is shown as a dot.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(make_printable(item) if isinstance(item, str) else item for item in arguments))


class InputWarning(UserWarning):
    """An input that can be computed with but may not be meant; the message is one sentence with value and remedy."""


class GeometryError(InputError):
    """A dimension, or a set of dimensions, that describes no solid."""


class SelectorError(InputError):
    """A selector of faces that does not do.

    Parameters
    ----------
    message
        One sentence.
    region
        The name that it was to give.
    number
        Index of the selector among those of that name.
    """

    # Defaults, since an error that comes back from another process is made of its message first.
    def __init__(self, message: str, region: str = "", number: int = 0) -> None:
        super().__init__(message)
        self.region = region
        self.number = number


class RegistryError(InputError):
    """A plug-in that fails, lacks a fact or has a name that is taken, or a name that no member has."""


class OutputError(InputError):
    """An output folder or file that cannot be written."""


class MissingSoftware(InputError):
    """A system library or a package that this machine lacks; the message holds the line that installs it."""


class ComputationFailed(RuntimeError):
    """A computation on sound input that did not converge or ran out of memory."""
