"""Force-displacement loops that agree with a model only in another unit, or without offsets of their sensors."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from correlation.campaign.measurement import Suspicion
from correlation.data_type.loop_prediction import predict_loop
from correlation.data_type.measured_loop import MIN_DEVIATION, ForceLoop, compute_loop_features
from correlation.model import Model
from correlation.signal.loop import analyse_loop

#: Root mean square error of a loop that triggers a search, and largest one with a correction [standard deviations];
#: least ratio of both [-]. Of 400 random loops, with models whose stiffness and limit have errors of 40 and 50 % (349
#: of them gross), 1 looks like a mistake; of 400 mistakes 371 are found.
GROSS, MENDED, BETTER = 5.0, 3.0, 4.0
#: Factors on displacement and force that correct a unit: the correction in words, and the possibly confused units.
UNITS = {
    (1e3, 1.0): ("1000 times its displacements", "in mm and read as um, or in m and read as mm"),
    (1e-3, 1.0): ("0.001 times its displacements", "in um and read as mm, or in mm and read as m"),
    (1.0, 1e3): ("1000 times its forces", "in kN and read as N"),
    (1.0, 1e-3): ("0.001 times its forces", "in mN and read as N, or in N and read as kN"),
}
NONE = (0.0, 0.0)


def find_loop_mistake(model: Model, loop: ForceLoop) -> Iterator[Suspicion]:
    """The unit that explains a gross misfit of a loop, otherwise the offsets of its two sensors.

    Parameters
    ----------
    model
        Model.
    loop
        Loop. That of a contact line is not checked, since its amplitude follows from the level.

    Raises
    ------
    CampaignError
        The model lacks the place.
    """
    if loop.place is None or not (before := _compute_misfit(model, loop)) > GROSS:
        return
    first = loop.loops.plateaus[0]
    offsets = -first.displacement_offset[0], -first.force_offset[0]
    # If the middle of the strokes was taken as zero, the displacement has no offset.
    moved = abs(offsets[0]) > MIN_DEVIATION * first.amplitude[0]
    read = f"{-offsets[0]:.3g} m and {-offsets[1]:.3g} N" if moved else f"{-offsets[1]:.3g} N"
    at_rest = f"without its offset of {read}: do its sensors read this at rest? If so, subtract it"
    questions = {
        (scale, NONE): f"with {change}: are they {units}? If so, correct the unit of their column"
        for scale, (change, units) in UNITS.items()
    } | {((1.0, 1.0), offsets): at_rest}
    left = {change: _compute_misfit(model, _change_loop(loop, *change)) for change in questions}
    # A loop in full stick has a single stiffness: the unit of force or of displacement may be wrong.
    result = [
        change for change in sorted(left, key=lambda one: left[one]) if left[change] < min(MENDED, before / BETTER)
    ]
    if result:
        yield Suspicion(
            where=loop.name,
            sentence=f"the model is off by {before:.3g} standard deviations (root mean square), and by "
            + "; or by ".join(f"{left[change]:.2g} {questions[change]}" for change in result),
        )


def _change_loop(loop: ForceLoop, scale: tuple[float, float], offset: tuple[float, float]) -> ForceLoop:
    """Loop with its signals shifted and then scaled."""
    x, f = scale[0] * (loop.displacement + offset[0]), scale[1] * (loop.force + offset[1])
    return replace(loop, displacement=x, force=f, loops=analyse_loop(x, f))


def _compute_misfit(model: Model, loop: ForceLoop) -> float:
    """Root mean square error of the features [standard deviations]; infinite without a prediction of all of them."""
    features = compute_loop_features(loop)
    error = (predict_loop(model, loop) - features.value) / features.deviation
    return float(np.sqrt(np.mean(error**2))) if len(error) and np.isfinite(error).all() else np.inf
