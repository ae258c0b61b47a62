"""Hidden laws: joints of the specimen, and their forces in closed form, independent of the laws of the program."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    JenkinsElement,
    Joint,
    Play,
    PolynomialSpring,
    PowerSpring,
    QuadraticDamper,
)

Samples = NDArray[np.float64]

KINDS = ("stop", "play", "cubic", "softening", "quadratic", "power", "drag", "iwan")
#: Displacements at which the four cells of an Iwan joint start to slip, relative to the motion of the law [-].
CELLS = (0.08, 0.2, 0.4, 0.8)


@dataclass(frozen=True, kw_only=True, eq=False)
class Hidden:
    """Hidden law at a place.

    Parameters
    ----------
    kind
        One of `KINDS`.
    place
        Name of the place.
    motion
        Displacement at which the stiffness is defined [m].
    stiffness
        Secant stiffness at this displacement; for drag, equivalent damping times Omega [N/m].
    shape
        Clearance relative to the displacement, or exponent [-].
    angular_frequency
        Angular frequency Omega of the equivalent damping [rad/s].
    """

    kind: str
    place: str
    motion: float
    stiffness: float
    shape: float
    angular_frequency: float

    def joints(self, row: Samples) -> Sequence[Joint]:
        """Joints of the law in the direction of a row."""
        k, a, shape = self.stiffness, self.motion, self.shape
        if self.kind == "stop":
            return [ElasticStop(name="hidden", direction=row, stiffness=self._closed, gap=shape * a)]
        if self.kind == "play":
            return [Play(name="hidden", direction=row, stiffness=self._closed, gap=shape * a)]
        if self.kind in ("cubic", "softening"):
            sign = 1 if self.kind == "cubic" else -1
            return [CubicSpring(name="hidden", direction=row, stiffness=sign * k / a**2)]
        if self.kind == "quadratic":
            return [PolynomialSpring(name="hidden", direction=row, quadratic=k / a)]
        if self.kind == "power":
            return [PowerSpring(name="hidden", direction=row, stiffness=k, reference=a, exponent=shape)]
        if self.kind == "drag":
            return [QuadraticDamper(name="hidden", direction=row, damping=self._drag)]
        return [
            JenkinsElement(
                name=f"hidden {number}", direction=row, tangential_stiffness=k / len(CELLS),
                limit_force=k / len(CELLS) * cell * a,
            )
            for number, cell in enumerate(CELLS)
        ]  # fmt: skip

    def force(self, u: Samples, v: Samples) -> Samples:
        """Force along periodic motions, shape (s, n) [N]."""
        k, a, shape = self.stiffness, self.motion, self.shape
        if self.kind == "stop":
            return np.asarray(self._closed * np.maximum(u - shape * a, 0))
        if self.kind == "play":
            return np.asarray(self._closed * (u - np.clip(u, -shape * a, shape * a)))
        if self.kind in ("cubic", "softening"):
            return np.asarray((1 if self.kind == "cubic" else -1) * k / a**2 * u**3)
        if self.kind == "quadratic":
            return np.asarray(k / a * u**2)
        if self.kind == "power":
            return np.asarray(k * np.sign(u) * a * np.abs(u / a) ** shape)
        if self.kind == "drag":
            return np.asarray(self._drag * np.abs(v) * v)
        total = np.zeros_like(u)
        for cell in CELLS:
            force, before, limit = np.zeros(len(u)), u[:, -1], k / len(CELLS) * cell * a
            for number in range(2 * u.shape[1]):
                now = u[:, number % u.shape[1]]
                force = np.clip(force + k / len(CELLS) * (now - before), -limit, limit)
                before = now
                if number >= u.shape[1]:
                    total[:, number % u.shape[1]] += force
        return total

    @property
    def words(self) -> tuple[tuple[str, ...], ...]:
        """Groups of words; a description needs one word of each group."""
        return {
            "stop": (("stop", "gap"), ("asymmetric",)),
            "play": (("gap",),),
            "cubic": (("hardening",),),
            "softening": (("softening",),),
            "quadratic": (("asymmetric",),),
            "power": (("hardening",),),
            "drag": (("drag",),),
            "iwan": (("memory",),),
        }[self.kind]

    @property
    def _closed(self) -> float:
        return self.stiffness / (1 - self.shape)

    @property
    def _drag(self) -> float:
        return self.stiffness / (self.angular_frequency**2 * self.motion)


def draw_hidden(
    place: str, motion: float, modal: float, angular_frequency: float, kind: str, random: np.random.Generator
) -> Hidden:
    """Draw a law with a secant stiffness of 1 to 8 % of the modal stiffness at its place.

    Drag has 0.15 times this stiffness, softening 0.7 times.
    """
    share = float(random.uniform(0.01, 0.08))
    shape = {"power": random.uniform(1.5, 2.5)}.get(kind, random.uniform(0.3, 0.6))
    factor = {"drag": 0.15, "softening": 0.7}.get(kind, 1.0)
    return Hidden(
        kind=kind, place=place, motion=motion, stiffness=factor * share * modal, shape=float(shape),
        angular_frequency=angular_frequency,
    )  # fmt: skip
