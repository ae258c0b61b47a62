"""A case with other values at some of its keys, as if they stood in its file."""

import copy
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from pydantic import ValidationError

from casefile import validation
from casefile.errors import CaseError
from casefile.table import CaseModel
from geometry.toml_position import Path

Case = TypeVar("Case", bound=CaseModel)


def vary_case(case: Case, values: Mapping[Path, object]) -> Case:
    """The case that its file would be with other values; each is checked as one in the file is.

    Parameters
    ----------
    case
        Case, as `casefile.table.load_case` returned it.
    values
        What a TOML file may hold, by the path of its key; tables that are missing on the way are made.

    Raises
    ------
    CaseError
        With every problem of the values; each has the line of the key that they replace.
    """
    source = case.source
    assert source is not None, "a case that was built in code has no keys to replace"
    data: dict[str, Any] = copy.deepcopy(dict(source.data))
    for path, value in values.items():
        table: Any = data
        for part in path[:-1]:
            table = table.setdefault(part, {}) if isinstance(part, str) else table[part]
        table[path[-1]] = value
    varied_source = replace(source, data=data)
    try:
        varied = type(case).model_validate({key: value for key, value in data.items() if key != "schema"})
    except ValidationError as error:
        raise CaseError(validation.problems(error, type(case), varied_source)) from None
    varied._source = varied_source
    return varied
