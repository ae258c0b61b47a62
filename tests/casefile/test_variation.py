"""A case with other values is the case that its file would be with them."""

from pathlib import Path
from typing import Annotated

import pytest
from pydantic import Field

from casefile.errors import CaseError
from casefile.quantity import Force
from casefile.table import CaseModel, load_case
from casefile.variation import vary_case


class Line(CaseModel):
    name: str
    preload: Annotated[Force, Field(gt=0)]


class Extra(CaseModel):
    factor: float | None = None


class Whole(CaseModel):
    line: tuple[Line, ...]
    extra: Extra = Extra()


@pytest.fixture
def case(tmp_path: Path) -> Whole:
    file = tmp_path / "case.toml"
    file.write_text('schema = 2\n[[line]]\nname = "wall"\npreload = "20 N"\n')
    return load_case(file, Whole)


def test_values_are_those_that_the_file_would_have_and_the_case_itself_stays(case: Whole) -> None:
    varied = vary_case(case, {("line", 0, "preload"): "0.3 kN", ("extra", "factor"): 2.0})
    assert (varied.line[0].preload, varied.extra.factor) == (300.0, 2.0)
    assert (case.line[0].preload, case.extra.factor) == (20.0, None)
    assert varied.source is not None
    assert varied.source.data["extra"] == {"factor": 2.0}


def test_a_wrong_value_is_refused_with_the_line_of_the_key_that_it_replaces(case: Whole) -> None:
    with pytest.raises(CaseError, match=r'case\.toml:4: line\[0\]\.preload = "-3 N": must be greater than 0'):
        vary_case(case, {("line", 0, "preload"): "-3 N"})
    with pytest.raises(CaseError, match=r"line\[0\]\.prelod: unknown key; did you mean"):
        vary_case(case, {("line", 0, "prelod"): "3 N"})
