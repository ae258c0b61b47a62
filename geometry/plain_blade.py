"""The plain blade: a uniform rectangular bar on a root block, the second shipped case."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class PlainBlade:
    """Dimensions of the plain blade [m]. Axes as in `geometry.blade.Blade`."""

    length: float = 0.2016
    thickness: float = 0.006
    chord: float = 0.024
    root_chord: float = 0.024
    root_thickness: float = 0.012
    root_height: float = 0.020
