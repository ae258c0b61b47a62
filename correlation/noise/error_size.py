"""Sizes of the errors of a model: usual sizes, limits of a sound model, and prior density."""

from dataclasses import astuple, dataclass

import numpy as np

from geometry.plain_number import format_number

#: Usual errors of frequencies and of damping over those of readings. At a peak with a quality factor of 50 both then
#: change readings by twenty times as much as far from the peak [-].
USUAL_RATIOS = (0.2, 20.0)
#: Largest errors of frequencies, damping, readings and shapes of a sound model; beyond these it is another structure,
#: and the errors of frequencies and damping are not small changes. Set on development seeds [-].
MAX_ERROR_SIZES = (0.02, 0.5, 0.1, 0.2)


@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of the relative errors of a model [-].

    Parameters
    ----------
    frequency, damping
        Errors of natural frequencies, and of damping, of each configuration at each level.
    reading
        Errors of each part of a curve, and additionally of each feature.
    shape
        Errors of a sensor's responses common to all levels, and of each part of them.
    """

    frequency: float = 0.0
    damping: float = 0.0
    reading: float = 0.0
    shape: float = 0.0

    @property
    def is_far(self) -> bool:
        """Whether a model with these errors is too far from the measurements to identify a missing effect."""
        return any(mine > far for mine, far in zip(astuple(self), MAX_ERROR_SIZES, strict=True))

    @property
    def words(self) -> str:
        """The sizes that are not zero, in words."""
        named = zip(
            ("natural frequencies", "damping", "the readings of a curve", "the shapes at all levels"),
            astuple(self),
            strict=True,
        )
        return " and ".join(f"{format_number(100 * value)} % in {name}" for name, value in named if value)

    @classmethod
    def usual(cls, reading: float) -> "ErrorSize":
        """Usual errors of a model with this error of readings far from resonances [-]."""
        return cls(
            frequency=USUAL_RATIOS[0] * reading, damping=USUAL_RATIOS[1] * reading, reading=reading, shape=reading
        )

    def is_within(self, other: "ErrorSize") -> bool:
        """Whether no size exceeds that of another."""
        return all(a <= b for a, b in zip(astuple(self), astuple(other), strict=True))

    def is_near(self, other: "ErrorSize", share: float) -> bool:
        """Whether all sizes agree within a share of the larger one."""
        return all(abs(a - b) <= share * max(a, b) for a, b in zip(astuple(self), astuple(other), strict=True))

    def scaled(self, share: float) -> "ErrorSize":
        """All sizes times a share."""
        return ErrorSize(*(share * size for size in astuple(self)))


NO_ERROR = ErrorSize()


def compute_prior(size: ErrorSize, usual: ErrorSize) -> float:
    """-2 ln of the prior density of a size; 0 without an error."""
    pairs = zip(astuple(size), astuple(usual), strict=True)
    return float(sum(2 * np.log1p((item / scale) ** 2) for item, scale in pairs if scale))
