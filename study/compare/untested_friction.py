"""Whether the compared data show slip at all: a model with stuck contacts may predict the same."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from correlation.campaign.measurement import Suspicion
from correlation.data_type.registry import DATA_TYPES, Datum
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from correlation.prediction import Prediction, Predictor
from diagnosis.fit.comparison import Comparison
from reduction.stuck import stick_at_rest
from study.compare.data import CLEAR_DEVIATION

HEADLINE = "no compared reading shows slip: friction was not tested"


def find_untested_friction(
    model: Model, data: Sequence[Datum], states: tuple[Comparison, Prediction] | None = None
) -> Iterator[Suspicion]:
    """A remark if the model with stuck contacts predicts the same for all compared data, within the deviations.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    data
        Compared data other than steady states.
    states
        Steady states and their prediction; None if there are none.
    """
    stuck = _stick(model)
    if len(stuck.system.joints) == len(model.system.joints):
        return
    if (states is not None and _states_slip(stuck, *states)) or any(_slips(model, datum) for datum in data):
        return
    has_contacts = any(getattr(datum, "configuration", "") != "free" for datum in data)
    has_contacts |= states is not None and not states[1].points.free.all()
    remedy = "measure at larger amplitudes" if has_contacts else "measure the structure with its contacts, too"
    yield Suspicion(
        where="campaign", remark=True, headline=HEADLINE,
        sentence=(
            "all compared predictions are the same, within their deviations, for this model with its contacts stuck: "
            f"friction coefficients, and preloads as far as they limit friction, were not tested; {remedy}"
        ),
    )  # fmt: skip


def _stick(model: Model) -> Model:
    """The model with springs for the joints that can slip, and without static load."""
    system = model.system
    slipping = [joint for joint in system.joints if joint.n_slider and joint.can_slip and any(joint.stuck_stiffness)]
    names = {joint.name for joint in slipping}
    linear = replace(
        system,
        stiffness=stick_at_rest(system.stiffness, slipping),
        joints=[joint for joint in system.joints if joint.name not in names],
        static_load=np.zeros(system.n_dof),
    )
    sensors = tuple(item for item in model.sensors if isinstance(item, Sensor))
    return replace(model, system=linear, sensors=sensors, lines={}, dead_weights={}, linked_preloads=())


def _slips(model: Model, datum: Datum) -> bool:
    """Whether stuck contacts change a number of a datum, or make it unpredictable."""
    kind = DATA_TYPES[datum.type]
    # A model without its lines can no longer derive its free structure.
    stuck = _stick(model.without_contacts() if getattr(datum, "configuration", "") == "free" else model)
    try:
        predicted = kind.predict(model, datum)
    except CampaignError:
        return False  # it is not compared
    try:
        apart = predicted - kind.predict(stuck, datum)
    except CampaignError:
        return True
    return bool((np.abs(apart) > CLEAR_DEVIATION * kind.features(datum).deviation).any())


def _states_slip(stuck: Model, comparison: Comparison, prediction: Prediction) -> bool:
    """Whether stuck contacts change steady states; the linear model has no higher harmonics."""
    points, value = prediction.points, np.array(prediction.value)
    rows = ~points.free & (points.harmonic > 0) & np.isin(points.sensor, [item.name for item in stuck.sensors])
    if not rows.any():
        return False
    value[rows] = Predictor(points=points.where(rows)).predict(stuck).value
    of_values, deviation = comparison.features.of_values, comparison.whitening.total_deviation
    return bool((np.abs(of_values(prediction.value) - of_values(value)) > CLEAR_DEVIATION * deviation).any())
