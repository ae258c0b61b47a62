"""Typical strengths of effects, from the first resonances, for models of any size.

With all contacts stuck, and without contacts, the structure is linear: its first mode that the force excites gives the
motion of a place at resonance, the damping, and the spring or mass that shifts the resonance.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from correlation.model import Model
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.resonance import ResonanceModel, Row, Rows, find_resonance
from reduction.jointed_system import JointedSystem

#: Configurations of tests: with the contacts of the lines, and without.
CONFIGURATIONS = ("jointed", "free")
#: Bound of a negative spring or mass, as a share of the one that makes the structure unstable or massless.
REMOVABLE = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class Scale:
    """Resonances of the tested configurations; a typical strength is significant in at least one of them.

    Parameters
    ----------
    system
        Structure with its contacts.
    resonances
        Resonance of each configuration.
    """

    system: JointedSystem
    resonances: tuple[ResonanceModel, ...]

    def share(self, row: Row, rows: Sequence[Row]) -> float:
        """Motion of a row relative to the largest motion of some rows, in the mode where this ratio is largest [-]."""
        shares = [0.0]
        for item in self.resonances:
            largest = max(item.motion(other) for other in rows)
            shares += [item.motion(row) / largest] if largest else []
        return max(shares)

    def amplitude(self, row: Row) -> float:
        """Amplitude of a displacement at the larger of the resonances [m]."""
        return max(item.amplitude(row) for item in self.resonances)

    def spring(self, row: Row) -> float | None:
        """Stiffness that shifts a resonance by `SHIFT` [N/m].

        Negative if the place moves so little that no added spring suffices, but removed stiffness does; None if neither
        does.
        """
        stiffer = _find_least(item.stiffening(row) for item in self.resonances)
        if stiffer is not None:
            return stiffer
        softer = _find_least(item.softening(row) for item in self.resonances)
        return softer if softer is not None and softer > -self.removable_stiffness(row) else None

    def point_mass(self, rows: Rows) -> float | None:
        """Mass that lowers a resonance by `SHIFT` [kg]; None if no mass can."""
        return _find_least(item.point_mass(rows) for item in self.resonances)

    def dashpot(self, row: Row) -> float:
        """Damping that adds `DAMPING_SHARE` to that of a mode [N s/m]."""
        return min(item.dashpot(row) for item in self.resonances)

    def drag(self, row: Row) -> float | None:
        """Quadratic damping that adds `DAMPING_SHARE` to that of a mode [N s^2/m^2]; None if nothing moves."""
        return _find_least(item.drag(row) for item in self.resonances)

    def cubic(self, row: Row) -> float | None:
        """Cubic stiffness equivalent to a spring that shifts a resonance by `SHIFT` [N/m^3]; None if there is none."""
        result = []
        for item in self.resonances:
            spring = item.stiffening(row) or item.softening(row)
            result.append(None if spring is None else item.cubic(row, spring))
        return _find_least(result)

    def removable_stiffness(self, row: Row) -> float:
        """Stiffness that can be removed from a structure supported without its contacts [N/m]; 0 if it is not."""
        try:
            compliance = float(row @ cho_solve(cho_factor(self.system.stiffness), row))
        except LinAlgError:
            return 0.0
        return REMOVABLE / compliance

    def removable_mass(self, rows: Rows) -> float:
        """Mass that can be removed with the mass matrix still positive definite [kg]."""
        inverse = rows @ cho_solve(cho_factor(self.system.mass), rows.T)
        return REMOVABLE / float(np.linalg.eigvalsh(inverse)[-1])


def measure_scale(
    model: Model,
    *,
    level: float = 1.0,
    configurations: Collection[str] | Mapping[str, float] = CONFIGURATIONS,
) -> Scale:
    """Scale of a model at a level.

    Parameters
    ----------
    model
        Model with its joints and loads.
    level
        Level of the force, preferably the highest of the tests [N].
    configurations
        Tested configurations: "jointed", and "free" without the contacts of its lines; or the level of each, since
        without contacts a structure moves further and is tested at lower levels [N].

    Raises
    ------
    EffectError
        The structure is not supported even with all contacts stuck, the mass is not positive definite, a level is not
        positive, or a configuration is unknown.
    """
    levels = configurations if isinstance(configurations, Mapping) else dict.fromkeys(configurations, level)
    for item in (level, *levels.values()):
        if not (np.isfinite(item) and item > 0):
            raise EffectError(f"level = {item:g} N must be positive: give the highest force level of the tests")
    for item in levels:
        if item not in CONFIGURATIONS:
            raise EffectError(f'"{item}" is not a configuration: give any of {", ".join(CONFIGURATIONS)}')
    free = "free" in levels and model.lines
    result = [find_resonance(model.without_contacts().system, levels["free"])] if free else []
    jointed = find_resonance(model.system, levels.get("jointed", level))
    if jointed is None:
        raise EffectError(
            "the lowest frequency with all contacts stuck is 0 Hz: hold the structure by a support or a contact"
        )
    if "jointed" in levels or not free:
        result.append(jointed)
    return Scale(system=model.system, resonances=tuple(item for item in result if item) or (jointed,))


def _find_least(strengths: Iterable[float | None]) -> float | None:
    return min((item for item in strengths if item is not None), key=abs, default=None)
