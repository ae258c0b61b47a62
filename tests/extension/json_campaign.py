"""A campaign format from outside: one JSON file with the tables of a campaign by their columns."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError

MARK = '{"campaign of": '


def recognise(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(MARK)) == MARK.encode()


def read(path: Path) -> Campaign:
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
        table = {name: np.array(column) for name, column in result["measurement"].items()}
        table["value"] = table.pop("real") + 1j * table.pop("imag")
        sensors = [{**item, "coordinates": _array(item["coordinates"])} for item in result["sensors"]]
        return Campaign(
            title=result["campaign of"],
            folder=path,
            sensors=tuple(MeasuredSensor(**item) for item in sensors),
            tests=tuple(Test(**item) for item in result["tests"]),
            measurement=Measurement(**table),
            held_out=HeldOut(**{name: tuple(values) for name, values in result["held_out"].items()}),
            records=tuple(
                TimeRecord(**{**item, "channels": tuple(item["channels"]), "units": tuple(item["units"])})
                for item in result["records"]
            ),
        )
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise CampaignError(f"{path}: is no campaign in JSON, or cut short ({error}): write it again") from None


def write(campaign: Campaign, path: Path) -> None:
    table = {item.name: getattr(campaign.measurement, item.name) for item in fields(Measurement)}
    value = table.pop("value")
    content = {
        "campaign of": campaign.title,
        "sensors": [asdict(item) for item in campaign.sensors],
        "tests": [asdict(item) for item in campaign.tests],
        "measurement": {**table, "real": value.real, "imag": value.imag},
        "held_out": asdict(campaign.held_out),
        "records": [asdict(item) for item in campaign.records],
    }
    path.write_text(json.dumps(content, default=_list), encoding="utf-8")


def _list(array: Any) -> Any:
    return array.tolist()


def _array(values: Any) -> Any:
    return None if values is None else np.array(values)


FORMATS.register(
    CampaignFormat(
        name="json campaign", holds="a JSON file with a whole campaign", recognise=recognise, read=read, write=write
    )
)
