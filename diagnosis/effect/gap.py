"""A contact line that does not lie flat: a gap that opens towards one of its ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import ROTATIONS, TRANSLATIONS, Model
from diagnosis.candidate.contact_line import find_contacts
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind
from reduction.jointed_system import FrictionContact

KIND = "gap"
#: Typical and largest gap over the elastic closure of the contacts by the preload.
TYPICAL, LARGEST = 0.25, 3.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Gap:
    """Adds a gap that is linear along a line.

    Parameters
    ----------
    line
        Name of the line.
    share
        Share of the gap at the end, for each contact in order, 0 to 1 [-].
    """

    name: str
    line: str
    share: tuple[float, ...]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "The surfaces are not parallel: a gap opens along the line towards this end, an edge or a rotation."
    signature: str = (
        "The line's mean normal force falls at all levels and contacts near this end lift off first, so that resonance "
        "frequencies fall early and even harmonics of the normal force appear; no change without contacts."
    )

    @property
    def end(self) -> tuple[str, bool]:
        """Line, and whether the gap opens towards its last contact; independent of the number of contacts."""
        return self.line, self.share[-1] == 1.0

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Gaps increase by their share; the static load is unchanged, since the line is loaded and not moved."""
        (gap,) = values
        members = find_contacts(model, self.line)
        change = {
            contact.name: {"gap": contact.gap + gap * share}
            for contact, share in zip(members, self.share, strict=False)
        }
        return model.with_joints(change)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """A gap at each end of each line; a single gap for a line with one contact."""
    if not model.lines:
        return [Untestable(name=KIND, reason="the model has no contact lines")]
    result: list[Effect | Untestable] = []
    for line in model.lines:
        members = find_contacts(model, line)
        if not members:
            result.append(Untestable(name=f"{KIND} of {line}", reason="the line has no contacts"))
            continue
        closing = sum(item.preload for item in members) / sum(item.normal_stiffness for item in members)
        if not closing > 0:
            size = size or measure_scale(model)
            closing = max(size.amplitude(item.normal) for item in members)
        if not closing > 0:
            reason = "the line has no preload and no force moves it, so that its contacts never close"
            result.append(Untestable(name=f"{KIND} of {line}", reason=reason))
            continue
        largest = LARGEST * closing
        parameter = EffectParameter(name="gap", unit="m", lower=-largest, upper=largest, typical=TYPICAL * closing)
        along = _locate_contacts(model, members)
        ends = {f"{KIND} of {line}": (1.0,)} if len(members) == 1 else {
            f"{KIND} of {line} at {members[0].name}": tuple(1 - item for item in along),
            f"{KIND} of {line} at {members[-1].name}": tuple(along),
        }  # fmt: skip
        result += [Gap(name=name, line=line, share=share, parameters=(parameter,)) for name, share in ends.items()]
    return result


def _locate_contacts(model: Model, members: Sequence[FrictionContact]) -> list[float]:
    """Position of each contact from the first (0) to the last (1): by coordinates, or evenly if these are unknown."""
    even = [number / max(len(members) - 1, 1) for number in range(len(members))]
    points = [_point(model, item) for item in members]
    known = [item for item in points if item is not None]
    if len(known) < len(members) or len(members) < 3:
        return even
    line = known[-1] - known[0]
    length = float(line @ line)
    along = [float((item - known[0]) @ line) / length for item in known] if length else []
    return along if along and all(one < other for one, other in pairwise(along)) else even


def _point(model: Model, contact: FrictionContact) -> Float[NDArray[np.float64], "3"] | None:
    """Weighted mean of the points of the translations in the directions of a contact; None if a point is unknown.

    Also None if the directions contain rotations of several points: the shape functions of beams and shells do not
    weight these by distance.
    """
    weights, points, rotates = [], [], False
    for number in np.flatnonzero(np.abs(contact.directions).max(axis=0)):
        dof = model.dofs[int(number)]
        if dof.direction == "modal" or dof.coordinates is None:
            return None
        rotates |= dof.direction in ROTATIONS
        weights.append(float(np.linalg.norm(contact.directions[:, number])) if dof.direction in TRANSLATIONS else 0.0)
        points.append(dof.coordinates)
    if not any(weights) or (rotates and any((point != points[0]).any() for point in points)):
        return None
    return np.asarray(np.average(np.array(points, dtype=np.float64), axis=0, weights=weights))


def _is_alike(one: Effect, other: Effect) -> bool:
    """Whether two gaps open towards the same end of one line; names of contacts may differ."""
    return isinstance(one, Gap) and isinstance(other, Gap) and one.end == other.end


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="contact lines", physics=Gap.physics, signature=Gap.signature,
        parameters={"gap": ("m",)}, candidates=candidates, order=12, has_two_sides=True, is_alike=_is_alike,
    )
)  # fmt: skip
