"""What can be wrong with a model that is compared with measurements, and with the measurements."""

from geometry.errors import InputError


class TestModelError(InputError):
    """A test model that contradicts itself: a sensor, line or part that does not fit the structure."""

    __test__ = False  # no test of pytest's


class CampaignError(InputError):
    """A campaign folder that cannot be used; the message names the file, the field, the value and the remedy."""
