"""A case whose load is not one newton drives the model by another force than was measured."""

import pytest

from correlation.campaign.measurement import Drive
from study.case.load_scale import find_scale_warning
from study.case.load_table import LoadTable

BASE, VOLTS = Drive(quantity="base acceleration", unit="m/s^2"), Drive(unit="V", calibrated=False)


@pytest.mark.parametrize(
    ("loads", "drive", "factor"),
    [
        ([{}], Drive(), None),
        ([{"amplitude": "2 N"}], Drive(), "2 times"),
        ([{"amplitude": "2 N"}], VOLTS, None),
        ([{"amplitude": "0.6 N"}, {"amplitude": "0.4 N"}], Drive(), None),
        ([{"base": "z"}], BASE, None),
        ([{"base": "z", "acceleration": "9.81 m/s^2"}], BASE, "9.81 times"),
        ([{"base": "z", "displacement": "1 um"}], BASE, None),
        ([{"amplitude": "2 N"}], BASE, None),
        ([], Drive(), None),
    ],
)
def test_the_load_is_one_of_the_unit_of_the_levels(
    loads: list[dict[str, str]], drive: Drive, factor: str | None
) -> None:
    place = {"dof": 0}
    tables = [LoadTable.model_validate(load if "base" in load else place | load) for load in loads]
    warning = find_scale_warning(tables, drive)
    assert (warning is None) == (factor is None)
    assert factor is None or factor in str(warning)
