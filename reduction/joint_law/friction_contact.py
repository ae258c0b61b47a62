"""Contact of the paper: a unilateral normal spring and elastic Coulomb friction."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Self

import numpy as np
from jaxtyping import Float

from reduction.array_type import Real, Row
from reduction.errors import ExchangeError, JointError
from reduction.joint_law.elastic_stop import ElasticStop
from reduction.joint_law.pressed_joint import PLAUSIBLE_FRICTION, PressedJoint
from reduction.joint_law.registry import LAWS, Joint, LawOption, LawParameter, Samples, SliderInterval


class Friction(Enum):
    """Coupling of the two tangents of a contact by Coulomb's limit."""

    UNCOUPLED = "uncoupled"
    """Each tangent has its own limit mu N."""
    COULOMB = "coulomb"
    """The resultant has the limit mu N and opposes the sliding (isotropic)."""


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionContact(PressedJoint):
    r"""Contact element of the paper: a unilateral normal spring and elastic Coulomb friction in one or two tangents.

    .. math:: N = \max(N_0 + k_n (v - g),\ 0), \qquad T = k_t (u - w), \qquad |T| \le \mu N

    with v > 0 closing; w is the position of the slider, and T = 0 in lift-off.

    Parameters
    ----------
    name
        Name in messages and results.
    normal
        Row of v, shape (r,) [-].
    tangents
        Rows of u, shape (1, r) or (2, r); a row of shape (r,) is converted to (1, r) [-].
    normal_stiffness, tangential_stiffness
        Normal and tangential stiffness k_n and k_t [N/m].
    friction_coefficient
        Friction coefficient mu [-].
    preload
        Preload N_0, the normal force at v = g; a negative value holds the contact open [N].
    gap
        Gap g; negative for an interference [m].
    friction
        Coupling of two tangents by the limit.

    Raises
    ------
    JointError
        A stiffness that is not positive, a friction coefficient that is negative or above 10, a number that is not
        finite, or another friction.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eqs 6-8.
    """

    kind = "friction"
    parameters = (
        LawParameter(name="tangential_stiffness", unit="N/m", meaning="k_t", typical=1e6, positive=True),
        LawParameter(name="normal_stiffness", unit="N/m", meaning="k_n", typical=1e6, positive=True),
        LawParameter(
            name="friction_coefficient", unit="-", meaning="mu", typical=0.4, lower=0.0, plausible=PLAUSIBLE_FRICTION
        ),
        LawParameter(name="preload", unit="N", meaning="N_0, the normal force at v = g", typical=30.0, default=0.0),
        LawParameter(name="gap", unit="m", meaning="g, negative for an interference", typical=0.0, default=0.0),
    )
    typical_displacement = 3e-5
    options = (LawOption(name="friction", choices=("uncoupled", "coulomb"), meaning="how two tangents share mu N"),)
    places = {"normal": True, "tangent": True, "second_tangent": False}  # noqa: RUF012  # never modified
    series_springs = True

    tangents: Float[Real, "tangent r"]
    tangential_stiffness: float
    friction_coefficient: float
    friction: Friction = Friction.UNCOUPLED

    def __post_init__(self) -> None:
        self.check_fields("normal", "tangents")
        if self.tangents.ndim == 1:
            object.__setattr__(self, "tangents", self.tangents[None, :])
        if self.tangents.ndim != 2 or len(self.tangents) not in {1, 2}:
            raise JointError(f'contact "{self.name}" has tangents of shape {self.tangents.shape}: give one or two rows')
        if self.tangents.shape[1:] != self.normal.shape:
            raise JointError(
                f'contact "{self.name}" has a normal over {self.normal.size} degrees of freedom but tangents over '
                f"{self.tangents.shape[1]}: both are rows over the whole structure"
            )
        friction: object = self.friction
        if not isinstance(friction, Friction):
            known = " or ".join(str(item) for item in Friction)
            raise JointError(f'joint "{self.name}": friction = {friction!r} must be {known}')

    @property
    def directions(self) -> Float[Real, "d r"]:
        """Tangents, then the normal, shape (n_tangent + 1, r) [-]."""
        return np.vstack([self.tangents, self.normal])

    @property
    def limit_at_rest(self) -> float:
        """Coulomb's limit mu N at v = 0 [N]."""
        return self.friction_coefficient * self.force_at_rest

    @property
    def coupled(self) -> bool:
        """Whether two tangents have one common limit."""
        return self.friction is Friction.COULOMB and len(self.tangents) == 2

    @property
    def force_law(self) -> str:
        """Name of the compiled force, which differs for uncoupled and coupled tangents."""
        return "coulomb" if self.coupled else "friction"

    @property
    def n_slider(self) -> int:
        """Number of sliders: one per tangent."""
        return len(self.tangents)

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffnesses k_t of the tangents, then k_n [N/m]."""
        return (self.tangential_stiffness,) * len(self.tangents) + (self.normal_stiffness,)

    @property
    def slider_intervals(self) -> tuple[SliderInterval, ...] | str:
        """Intervals with limits that depend on v; coupled tangents have none, because their limit is a disc."""
        if self.coupled:
            return "has one Coulomb limit for both tangents: use uncoupled friction, or one tangent"
        kt, mu, kn = self.tangential_stiffness, self.friction_coefficient, self.normal_stiffness
        constant, normal = mu * (self.preload - kn * self.gap), len(self.tangents)
        return tuple(SliderInterval(tangent, normal, kt, constant, mu * kn) for tangent in range(normal))

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy T^2 / (2 k_t) of the tangents, plus that of the normal spring."""
        tangents = np.sum(force[:-1] ** 2, axis=0) / (2 * parameters["tangential_stiffness"])
        return np.asarray(tangents + self.normal_energy(parameters, displacement[-1]))

    def exported(self, program: str) -> Joint:
        """Equivalent stop of a contact without friction, k_n max(v - (g - N_0 / k_n), 0).

        Raises
        ------
        ExchangeError
            A contact with friction, whose limit depends on the varying normal force.
        """
        if self.friction_coefficient > 0:
            raise ExchangeError(
                f'joint "{self.name}" is a friction contact whose normal force varies, which {program} does not have: '
                f"give a JenkinsElement with the limit mu N0 = {self.friction_coefficient * self.preload:g} N if it "
                "hardly varies"
            )
        return ElasticStop(
            name=self.name,
            direction=self.normal,
            stiffness=self.normal_stiffness,
            gap=self.gap - self.preload / self.normal_stiffness,
        )

    @classmethod
    def build(cls, name: str, rows: Mapping[str, Row], values: Mapping[str, Any]) -> Self:
        """Joint from the entries of a case file, as in `Joint`."""
        tangents = np.array([rows[place] for place in ("tangent", "second_tangent") if place in rows])
        chosen = {"friction": Friction(values["friction"])} if "friction" in values else {}
        return cls(name=name, normal=rows["normal"], tangents=tangents, **{**values, **chosen})


def list_friction_contacts(joints: Iterable[Joint]) -> list[FrictionContact]:
    """Friction contacts among some joints, in their order."""
    return [joint for joint in joints if isinstance(joint, FrictionContact)]
