"""The pages on the bodies show the dimensions that the code builds."""

import re
from dataclasses import asdict
from math import degrees
from pathlib import Path

import pytest

from geometry.blade import Blade
from geometry.damper import Damper
from geometry.decoupler import Decoupler
from geometry.plain_blade import PlainBlade

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize(
    ("page", "title", "body"),
    [
        ("blade.md", "The rig's blade", Blade()),
        ("blade.md", "The plain blade", PlainBlade()),
        ("rig.md", "The damper", Damper()),
        ("rig.md", "The de-coupler", Decoupler()),
    ],
)
def test_the_page_lists_every_dimension_with_its_default(
    page: str, title: str, body: Blade | PlainBlade | Damper | Decoupler
) -> None:
    section = (DOCS / page).read_text().split(f"## {title}\n")[1].split("\n## ")[0]
    listed = dict(re.findall(r"^\| `(\w+)` \| ([^|]+) \|", section, flags=re.MULTILINE))
    built = {
        name: f"{degrees(value):.6g} deg" if name.endswith("angle") else f"{1e3 * value:.6g} mm"
        for name, value in asdict(body).items()
    }
    assert listed == built
