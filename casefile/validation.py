"""Errors of pydantic on a case as sentences, each with the key, the value and the remedy."""

import difflib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from casefile.errors import Problem
from casefile.quantity import dimensions
from casefile.source import CaseSource, dotted, find_value
from geometry.toml_position import Path

Item = TypeVar("Item")
# These messages hold a number of the model, which is in SI.
BOUND_ERRORS = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}

# How pydantic says it, and how we do.
PLAIN_WORDS = (
    (r"^Value error, ", ""),
    (r"^Input should be a valid integer.*", "must be a whole number, without quotes"),
    (r"^Input should be a valid number.*", "must be a number, without quotes"),
    (r"^Input should be a valid boolean.*", "must be true or false"),
    (r"^Input should be a valid string$", 'must be text in quotes, e.g. "name"'),
    (r"^Input should be a valid (list|tuple)$", "must be a list in brackets, e.g. [1, 2]"),
    (r"^(List|Tuple) should have at least (\d+) items? after validation, not (\d+)$", r"must have at least \2, not \3"),
    (r"^String should have at least 1 character$", "must not be empty"),
    (r"^Input should be a valid dictionary.*", "must be a table of keys"),
    (r"^Input should be ", "must be "),
    (r"^Input should ", "must "),
)


def problems(error: ValidationError, model: type[BaseModel], source: CaseSource) -> list[Problem]:
    """Every problem that pydantic found, each with its line.

    Parameters
    ----------
    error
        Error of pydantic.
    model
        The model that was validated.
    source
        The file that the data came from.
    """
    result = error.errors()
    places = [details["loc"] for details in result]
    # A list whose entries were refused is empty then, and pydantic calls it too short as well.
    own = [item for item in result if item["type"] != "too_short" or not _is_refused_within(item["loc"], places)]
    # A union reports its problem once for every branch.
    return list(dict.fromkeys(_make_problem(details, model, source) for details in own))


def doubts(table: BaseModel, source: CaseSource, path: Path = ()) -> Iterator[Problem]:
    """Values that are possible but unusual in their place, each with its line.

    Parameters
    ----------
    table
        A validated case, or a table of it.
    source
        The file that it came from.
    path
        Path of the table in the file.
    """
    for name, field in type(table).model_fields.items():
        value, own = getattr(table, name), (*path, field.alias or name)
        if isinstance(value, BaseModel):
            yield from doubts(value, source, own)
        elif isinstance(value, list | tuple):
            for number, item in enumerate(value):
                if isinstance(item, BaseModel):
                    yield from doubts(item, source, (*own, number))
        elif isinstance(value, float):
            for plausibility in (dimension.plausibility for dimension in dimensions(field)):
                doubt = plausibility.doubt(value, find_value(source.data, own)) if plausibility else ""
                if doubt:
                    yield source.problem(own, doubt)


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """``; did you mean "length"?`` if a known word is near, nothing if none is."""
    by_lower = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), list(by_lower), 1, 0.5)
    return f'; did you mean "{by_lower[close[0]]}"?' if close else ""


def require_different(values: tuple[Item, ...]) -> tuple[Item, ...]:
    """The values of a list; refuse a repeated one.

    Raises
    ------
    ValueError
        With the first that does.
    """
    for place, value in enumerate(values):
        if value in values[:place]:
            text = f"{value:g}" if isinstance(value, float) else f'"{value}"' if isinstance(value, str) else value
            raise ValueError(f"{text} appears twice: remove one")
    return values


def _make_problem(details: ErrorDetails, model: type[BaseModel], source: CaseSource) -> Problem:
    missing = details["type"] == "missing"
    path = _find_path_in_file(details["loc"], source.data, keep_last=missing)
    if missing:
        return _describe_missing(path, model, source)
    if details["type"] == "extra_forbidden":
        return source.problem(path, _describe_unknown_key(path, model, source), show_value=False)
    if details["type"] == "union_tag_invalid":
        return _describe_unknown_kind(path, details, source)
    value = find_value(source.data, path)
    if details["type"] in {"model_type", "model_attributes_type", "dict_type"}:
        if any(isinstance(key, int) for key in path):  # a table within a list has no header of its own
            return source.problem(path, "must be a table; write its keys in braces, { key = value }")
        return source.problem(path, f"must be a table; write [{dotted(path)}] and its keys below it")
    if details["type"] in {"list_type", "tuple_type"} and _find_models(model, path):
        return source.problem(path, f"must be a list of tables; write [[{dotted(path)}]] above the keys of each")
    text = details["msg"]
    for pattern, plain in PLAIN_WORDS:
        text = re.sub(pattern, plain, text)
    if details["type"] in BOUND_ERRORS:
        text += _find_si_unit(path, model, source.data)
    if details["type"] in {"literal_error", "enum"}:
        text = text.replace("'", '"')
        choices = re.findall(r'"([^"]*)"', text)
        # Of one choice the words before say it already.
        text += did_you_mean(value, choices) if isinstance(value, str) and len(choices) > 1 else ""
    return source.problem(path, text)


def _is_refused_within(place: tuple[str | int, ...], places: Sequence[tuple[str | int, ...]]) -> bool:
    return any(len(other) > len(place) and other[: len(place)] == place for other in places)


def _describe_unknown_kind(path: Path, details: ErrorDetails, source: CaseSource) -> Problem:
    """The key that says of which kind a table is, and the kinds there are."""
    context = details["ctx"]
    choices = re.findall(r"'([^']*)'", context["expected_tags"])
    *others, last = (f'"{choice}"' for choice in choices)
    listed = f"{', '.join(others)} or {last}" if others else last
    return source.problem(
        (*path, context["discriminator"].strip("'")),
        f"must be {listed}" + (did_you_mean(context["tag"], choices) if others else ""),
    )


def _find_path_in_file(location: Sequence[str | int], data: Any, *, keep_last: bool) -> Path:
    """Pydantic's location without the names of validators and union branches, which no file contains."""
    path: Path = ()
    for position, part in enumerate(location):
        here = find_value(data, path)
        in_mapping = isinstance(here, Mapping) and part in here
        in_list = isinstance(here, list) and isinstance(part, int)
        if in_mapping and _is_branch(here, part, location[position + 1 :], keep_last=keep_last):
            continue
        if in_mapping or in_list or (keep_last and position == len(location) - 1):
            path = (*path, part)
    return path


def _is_branch(table: Any, part: str | int, rest: Sequence[str | int], *, keep_last: bool) -> bool:
    """Whether a part names a branch of a union, such as "friction", although the table has such a key too."""
    if isinstance(table[part], Mapping | list):
        return False
    return bool(rest) and (keep_last or any(item in table for item in rest))


def _describe_missing(path: Path, model: type[BaseModel], source: CaseSource) -> Problem:
    key = str(path[-1])
    if _find_models(model, path):
        many = any(get_origin(field.annotation) in {list, tuple} for field in _find_fields(path, model, source.data))
        table = f"[[{dotted(path)}]]" if many else f"[{dotted(path)}]"
        what = f"table {table} is missing; add it"
    else:
        example = _find_example(path, model, source.data)
        what = f"{dotted(path)} is missing; add {key} = {example}" if example else f"{dotted(path)} is missing; add it"
    return replace(source.problem(path, ""), text=what)


def _find_example(path: Path, model: type[BaseModel], data: Any) -> str:
    for field in _find_fields(path, model, data):
        if field.examples:
            return json.dumps(field.examples[0], ensure_ascii=False)
    return ""


def _find_si_unit(path: Path, model: type[BaseModel], data: Any) -> str:
    result = [dimension.si for field in _find_fields(path, model, data) for dimension in dimensions(field)]
    return f" {result[0]}" if result and result[0] else ""


def _find_fields(path: Path, model: type[BaseModel], data: Any) -> list[FieldInfo]:
    """Fields that may describe the key at a path; two kinds of tables may use one name for different quantities."""
    table = find_value(data, path[:-1])
    parents = [parent for parent in _find_models(model, path[:-1]) if _is_of_kind(parent, table)] if path else []
    fields = [_list_fields(parent).get(str(path[-1])) for parent in parents]
    return [field for field in fields if field is not None]


def _describe_unknown_key(path: Path, model: type[BaseModel], source: CaseSource) -> str:
    table = find_value(source.data, path[:-1])
    parents = [parent for parent in _find_models(model, path[:-1]) if _is_of_kind(parent, table)]
    known = [name for parent in parents for name in _list_fields(parent)]
    key = str(path[-1])
    kind = "table" if isinstance(find_value(source.data, path), Mapping) else "key"
    hint = did_you_mean(key, known)
    if hint:
        return f"unknown {kind}{hint}"
    return f"unknown {kind}; known here: {', '.join(known)}" if known else f"unknown {kind}; remove it"


def _is_of_kind(model: type[BaseModel], table: Any) -> bool:
    """Whether a table, by the key that says of which kind it is, may be described by a model."""
    if not isinstance(table, Mapping):
        return True
    kinds = {name: field for name, field in _list_fields(model).items() if get_origin(field.annotation) is Literal}
    return all(table[name] in get_args(field.annotation) for name, field in kinds.items() if name in table)


def _list_fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Fields by the name that a file uses."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _find_models(model: type[BaseModel], path: Path) -> list[type[BaseModel]]:
    """Models that may describe the table at a path: several where the case allows a choice."""
    here = [model]
    for part in path:
        if isinstance(part, int):
            continue  # The elements of a list are described where the list is.
        fields = [_list_fields(parent).get(part) for parent in here]
        here = [nested for field in fields if field is not None for nested in _list_nested_models(field.annotation)]
    return here


def _list_nested_models(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _list_nested_models(argument)
