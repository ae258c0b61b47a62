"""Tree of errors of inputs, and tree of warnings about doubtful inputs.

::

    ValueError
    └── InputError            the user can correct it: one sentence with the value and the remedy
        ├── GeometryError     a dimension or a shape that cannot be built
        ├── SelectorError     a selector that fits no face, or a face that another region has
        ├── RegistryError     a plug-in that fails, lacks a fact or has a name in use, or an unknown name
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
    └── ComputationFailed     the input is valid, but there is no result

    UserWarning
    └── InputWarning          the input is used as it is, but may not be intended
        └── hbsolve.errors.DampingWarning

These classes are in the lowest package, so that every other package can derive from them.
"""

import re

#: Largest number of characters without a blank in a message, enough for a path; a damaged value may have thousands.
LONGEST_WORD = 500
_LONG_WORD = re.compile(rf"\S{{{LONGEST_WORD},}}")


def make_printable(text: str) -> str:
    """Text that a terminal can show: without control characters, and with long words cut off."""
    short = _LONG_WORD.sub(lambda word: f"{word[0][:LONGEST_WORD]}...", text)
    return "".join(letter if letter.isprintable() or letter == "\n" else "·" for letter in short)


class InputError(ValueError):
    """Error for an input that the user can correct; the message is one sentence with the value and the remedy.

    Characters that are not printable, for example in values from files, are shown as dots.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(make_printable(item) if isinstance(item, str) else item for item in arguments))


class InputWarning(UserWarning):
    """Warning about an input that is used but may not be intended, in one sentence with the value and the remedy."""


class GeometryError(InputError):
    """Error for dimensions of which no solid can be built."""


class SelectorError(InputError):
    """Error for a selector that fits no face, or a face of another region.

    Parameters
    ----------
    message
        Message in one sentence.
    region
        Name of the region of the selector.
    number
        Index of the selector among those of the region.
    """

    # The defaults are needed because an error from another process is first constructed from its message.
    def __init__(self, message: str, region: str = "", number: int = 0) -> None:
        super().__init__(message)
        self.region = region
        self.number = number


class RegistryError(InputError):
    """Error for a plug-in that fails, lacks a fact or has a name that is in use, or for an unknown name."""


class OutputError(InputError):
    """Error for an output folder or file that cannot be written."""


class MissingSoftware(InputError):
    """Error for a missing system library or package; the message contains the command that installs it."""


class ComputationFailed(RuntimeError):
    """Error for a computation on valid input that did not converge or ran out of memory."""
