"""A campaign format, added by one file outside the product, passes what every format must."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from tests.correlation.campaign import test_format
from tests.correlation.campaign.test_write_campaign import made
from tests.extension.sweep import sweeps

FILE = Path(__file__).with_name("json_campaign.py")


@pytest.fixture(scope="module")
def campaign_format() -> Iterator[CampaignFormat]:
    """The format; the other tests of this process do without it."""
    (result,) = FORMATS.load(FILE)
    yield result
    FORMATS.forget(FILE)


globals().update(sweeps("campaign_format", test_format))


def test_a_path_of_no_format_is_told_all_that_there_are(campaign_format: CampaignFormat, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"there is no campaign\.toml in .*; or give a JSON file"):
        read_campaign(tmp_path)


def test_a_format_that_fails_is_named_with_its_file(
    campaign_format: CampaignFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert campaign_format.write is not None
    campaign_format.write(made(), tmp_path / "one.json")

    def fail(path: Path) -> Campaign:
        raise ZeroDivisionError(path)

    monkeypatch.setitem(vars(campaign_format), "read", fail)
    with pytest.raises(
        CampaignError, match=r'"json campaign" \(.*json_campaign\.py, line \d+\) fails with ZeroDivision'
    ):
        read_campaign(tmp_path / "one.json")
