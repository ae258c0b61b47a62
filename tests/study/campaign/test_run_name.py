"""What the name of a file says of the contacts of a structure."""

import pytest

from study.campaign.draft import ManifestDraft
from study.campaign.draft_frequency import ask_configuration
from study.campaign.question import Assumptions


@pytest.mark.parametrize(
    ("name", "configuration"),
    [
        ("free_decay_jointed", "jointed"), ("freeDecayWithContacts", "jointed"), ("jointed free vibration", "jointed"),
        ("free_decay_without_contacts", "free"), ("decay_unjointed", "free"), ("free_blade", "free"),
        ("decay_without_joints", "free"), ("decay", "jointed"),
    ],
)  # fmt: skip
def test_contacts_in_a_name_count_before_its_free_decay(name: str, configuration: str) -> None:
    assert ask_configuration(ManifestDraft(title="", answers=Assumptions()), name).value == configuration
