"""The volume of a de-coupler by hand."""

from math import acos, sqrt

import numpy as np
from scipy.integrate import quad

from geometry.decoupler import Decoupler, make_outline


def volume(decoupler: Decoupler) -> float:
    """Prism over the outline, and the pad less its groove [m^3]."""
    y, z = np.array(make_outline(decoupler)).T
    area = abs(y @ np.roll(z, 1) - z @ np.roll(y, 1)) / 2
    pad = (decoupler.top - decoupler.lip_above_axis) * decoupler.plate_front
    return float((area + pad) * decoupler.width) - groove_volume(decoupler)


def groove_volume(decoupler: Decoupler) -> float:
    """What the groove takes from the pad: segments of circles [m^3]."""
    lip = decoupler.lip_above_axis

    def section(at: float) -> float:
        r = float(decoupler.groove_radius_at(np.array(at)))
        return r * r * acos(lip / r) - lip * sqrt(r * r - lip * lip)

    return float(quad(section, 0.0, decoupler.plate_front, epsrel=1e-12)[0])
