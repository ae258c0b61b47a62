"""Sensors of a campaign on a model: places that contradict the model's sensor of that name are refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor
from correlation.campaign.run_table import join_rows
from correlation.errors import CampaignError
from correlation.model import Dof, Model, Sensor
from correlation.sensor_placement import with_sensors


def campaign(place: str | None, name: str = "tip", direction: str = "z") -> Campaign:
    tip = MeasuredSensor(name=name, quantity="displacement", direction=direction, place=place)
    return Campaign(
        title="", folder=Path(), sensors=(tip,), tests=(), measurement=join_rows([]), held_out=HeldOut()
    )  # fmt: skip


def model(small: Model) -> Model:
    """Two places, and a sensor with a gain at the first."""
    rows = np.eye(small.system.n_dof)
    tip = Sensor(name="tip", row=1.2 * rows[0], quantity="displacement")
    return replace(small, places={"tip": rows[0], "mid": rows[1]}, sensors=(tip,))


def test_a_sensor_of_the_model_keeps_its_gain(small: Model) -> None:
    (tip,) = with_sensors(model(small), campaign("tip")).sensors
    assert isinstance(tip, Sensor)
    assert tip.row.max() == 1.2


def test_a_sensor_of_the_model_needs_no_place_and_direction(small: Model) -> None:
    (tip,) = with_sensors(model(small), campaign(None, direction="")).sensors
    assert isinstance(tip, Sensor)
    assert tip.row.max() == 1.2
    with pytest.raises(CampaignError, match=r'no sensor "root": add it to the case, or give its place or coordinates'):
        with_sensors(model(small), campaign(None, "root", ""))


@pytest.mark.parametrize("direction", ["x", "rz"])
def test_a_direction_that_the_sensor_of_the_model_does_not_read_is_refused(small: Model, direction: str) -> None:
    along_z = replace(model(small), dofs=tuple(Dof(node=n, direction="z") for n in range(small.system.n_dof)))
    assert len(with_sensors(along_z, campaign("tip")).sensors) == 1
    with pytest.raises(CampaignError, match=rf'sensor "tip" reads along {direction}, the model.* along z: correct one'):
        with_sensors(along_z, campaign("tip", direction=direction))


def test_a_rotation_needs_its_direction_which_decides_the_unit(small: Model) -> None:
    turned = replace(model(small), dofs=tuple(Dof(node=n, direction="ry") for n in range(small.system.n_dof)))
    with pytest.raises(CampaignError, match=r'sensor "tip" reads a rotation.*add direction = "ry"$'):
        with_sensors(turned, campaign(None, direction=""))
    assert len(with_sensors(turned, campaign(None, direction="ry")).sensors) == 1


@pytest.mark.parametrize(("place", "message"), [("middle", "does not have; its places: tip, mid"), ("mid", "not read")])
def test_a_place_that_the_sensor_of_the_model_does_not_read_is_refused(small: Model, place: str, message: str) -> None:
    with pytest.raises(CampaignError, match=rf'sensor "tip" sits at place "{place}".*{message}'):
        with_sensors(model(small), campaign(place))


def test_a_sensor_of_nearly_the_name_of_the_models_is_offered_its_name_and_place(small: Model) -> None:
    known = model(small)
    with pytest.raises(
        CampaignError,
        match=r'"middle".* sensor "tip"\? then give it this name here and in its columns, and place = "tip"',
    ):
        with_sensors(known, campaign("middle", "tip 1"))
    assert len(with_sensors(known, campaign("tip", "tip 1")).sensors) == 2
    with pytest.raises(CampaignError, match=r'"middle" to the case$'):
        with_sensors(known, campaign("middle", "root"))
    # A load cell or a velocity is not meant by the name of a displacement.
    velocity = replace(known, sensors=tuple(replace(sensor, quantity="velocity") for sensor in known.sensors))
    with pytest.raises(CampaignError, match=r'"middle" to the case$'):
        with_sensors(velocity, campaign("middle", "tip 1"))
