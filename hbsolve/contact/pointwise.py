"""Laws whose force depends on the displacement and velocity of the same instant alone."""

from typing import Any

import numpy as np

from fe.compiled import compiled


@compiled
def displacement_jacobian(slope: Any, sampling: Any, out: Any) -> None:
    """Jacobian of a force with the slope df/du at each instant, shape (n,) [N/m]."""
    nh = sampling.evaluate.shape[0]
    out.active[0] = nh
    out.jacobian[0, :, :nh] = np.dot((sampling.project * slope.reshape(-1, 1)).T, sampling.instants)


@compiled
def velocity_jacobian(slope: Any, sampling: Any, out: Any) -> None:
    """Jacobian of a force with the slope df/d(du/d(Omega t)) at each instant, shape (n,) [N/m]."""
    nh = sampling.evaluate.shape[0]
    out.active[0] = nh
    out.jacobian[0, :, :nh] = np.dot((sampling.project * slope.reshape(-1, 1)).T, sampling.differentiate.T)
