"""The page of the method names constants that the code has, where it has them."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROW = re.compile(r"^\| (`[^|]+) \| [^|]+ \| .+ \| `([^`|]+\.py)`(?:, `([^`|]+\.py)`)? \|$", re.MULTILINE)


def test_each_constant_of_the_method_is_defined_in_its_file() -> None:
    page = (ROOT / "docs" / "diagnose_method.md").read_text(encoding="utf-8")
    rows = ROW.findall(page.split("## Constants")[1])
    assert len(rows) == page.split("## Constants")[1].count("\n| `")
    for names, *files in rows:
        code = "".join((ROOT / "diagnosis" / file).read_text(encoding="utf-8") for file in files if file)
        for name in re.findall(r"`(?:\w+\.)?(\w+)`", names):
            assert re.search(rf"^\s*(\w+, )?{name}\b(, \w+)?(: float)? = ", code, re.MULTILINE), name
