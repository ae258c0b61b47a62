"""A support that moves as one rigid piece on springs: a relaxed clamp."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.resonance import SHIFT, ResonanceModel
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind
from reduction.elastic_support import ElasticBody

KIND = "compliance"
#: Largest over typical strength.
LARGEST = 100.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Compliance:
    """Adds to the compliance of the springs under a part."""

    name: str
    part: str
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "The clamp is compliant: the fixed faces of the part move as one rigid body on springs."
    signature: str = (
        "Each resonance frequency falls by its own share, equal at all levels, with and without contacts; most in the "
        "modes that load the clamp most; no higher harmonics."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The matrices of the part on softer springs; the compliance is at least that of a fixed support, zero."""
        (added,) = values
        body = model.elastic_bodies.get(self.part)
        if body is None or not added:
            return model
        return model.with_elastic_body(self.part, replace(body, compliance=max(body.compliance + added, 0.0)))


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The compliance under each part with a known support."""
    result: list[Effect | Untestable] = []
    for part, body in model.elastic_bodies.items():
        name = f"{KIND} of the clamp of {part}"
        size = size or measure_scale(model)
        typical = min((item for item in (_compute_typical(one, body) for one in size.resonances) if item), default=None)
        if typical is None:
            result.append(Untestable(name=name, reason="no compliance there lowers the first resonance by 0.5 %"))
            continue
        # The lower bound is a fixed support.
        parameter = EffectParameter(
            name="compliance", unit="m/N", lower=-body.compliance, upper=LARGEST * typical, typical=typical
        )
        result.append(Compliance(name=name, part=part, parameters=(parameter,)))
    return result or [Untestable(name=KIND, reason="the model does not define a compliance of its supports")]


def _compute_typical(resonance: ResonanceModel, body: ElasticBody) -> float | None:
    """Compliance that lowers the resonance by `SHIFT`, to first order [m/N]; None if the mode does not load it."""
    force = body.support.motion.T @ body.matrices[1] @ resonance.mode_shape
    # The mode does the work of its forces on the springs: d omega^2 = -c f^T kappa^-1 f.
    softer = float(force @ np.linalg.solve(body.support.springs, force))
    return 2 * SHIFT * resonance.angular_frequency**2 / softer if softer > 0 else None


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="parts on a clamp", physics=Compliance.physics, signature=Compliance.signature,
        parameters={"compliance": ("m/N",)}, candidates=candidates, order=16,
    )
)  # fmt: skip
