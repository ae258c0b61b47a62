"""A type of data, added by one file outside the product, is read from a manifest, compared and fitted."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.registry import DATA_TYPES, DataType
from correlation.errors import CampaignError
from geometry.errors import RegistryError
from study.compare.data import compare_data, describe_data
from tests.diagnosis.fit.test_feature_comparison import make_model

FILE = Path(__file__).with_name("peak_list.py")
MANIFEST = 'schema = 1\n[[peak]]\nname = "first"\nfrequency = "{frequency}"\n'


@pytest.fixture(scope="module", autouse=True)
def data_type() -> Iterator[DataType]:
    (member,) = DATA_TYPES.load(FILE)
    yield member
    DATA_TYPES.forget(FILE)


def test_its_tables_are_read_and_compared(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(MANIFEST.format(frequency="32 Hz"), encoding="utf-8")
    campaign = read_campaign(tmp_path)
    (compared,) = compare_data(make_model(), campaign.data)
    # sqrt(4e4) rad/s is 31.83 Hz: 0.5 % below, five deviations of 0.1 %.
    assert compared.error[0] == pytest.approx(-5.3, abs=0.1)
    assert "32" in "\n".join(describe_data([compared]))


def test_its_mistakes_name_table_and_key(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(MANIFEST.format(frequency="32 N"), encoding="utf-8")
    with pytest.raises(CampaignError, match=r"peak\[1\]\.frequency = \"32 N\""):
        read_campaign(tmp_path)


def test_a_type_without_a_fact_is_refused(data_type: DataType) -> None:
    with pytest.raises(RegistryError, match="table"):
        DATA_TYPES.register(DataType(**{**vars(data_type), "name": "other", "table": "sensor"}))
