"""The page on the blades shows the dimensions that the code builds."""

import re
from dataclasses import asdict
from math import degrees
from pathlib import Path

import pytest

from geometry.blade import Blade
from geometry.plain_blade import PlainBlade

PAGE = Path(__file__).parents[2] / "docs" / "blade.md"


@pytest.mark.parametrize(("title", "blade"), [("The rig's blade", Blade()), ("The plain blade", PlainBlade())])
def test_the_page_lists_every_dimension_with_its_default(title: str, blade: Blade | PlainBlade) -> None:
    section = PAGE.read_text().split(f"## {title}\n")[1].split("\n## ")[0]
    listed = dict(re.findall(r"^\| `(\w+)` \| ([^|]+) \|", section, flags=re.MULTILINE))
    built = {
        name: f"{degrees(value):.6g} deg" if name.endswith("angle") else f"{1e3 * value:.6g} mm"
        for name, value in asdict(blade).items()
    }
    assert listed == built
