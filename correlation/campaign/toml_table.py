"""Reader of a table of a TOML file, key by key; a mistake is one sentence with file, key, value and remedy."""

import difflib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from correlation.errors import CampaignError
from geometry.toml_position import Path

Value = TypeVar("Value")
_REQUIRED = object()


@dataclass(kw_only=True)
class TomlTable:
    """Table that records which of its keys were read; `finish` refuses all others.

    Parameters
    ----------
    file
        Name of the file.
    path
        Dotted path of the table; empty for the root of the file.
    values
        Keys and values.
    at
        Position of the table in the file, as keys and indices.
    lines
        Line of each key of the file; empty if the lines are unknown.
    known
        Keys that were read.
    """

    file: str
    path: str = ""
    values: Mapping[str, Any]
    at: Path = ()
    lines: Mapping[Path, int] = field(default_factory=dict)
    known: set[str] = field(default_factory=set)

    def problem(self, key: str, text: str, *, show: bool = True) -> CampaignError:
        """Error about a key, with its value if `show` is true."""
        shown = f" = {_shorten(self.values[key])}" if show and key in self.values else ""
        return CampaignError(f"{self.where(key)}{shown}: {text}")

    def where(self, key: str = "") -> str:
        """File, line and dotted path of a key, or of the table; a missing key has the line of the table."""
        known: Path = (*self.at, key)
        while known and known not in self.lines:
            known = known[:-1]
        line = f":{self.lines[known]}" if known in self.lines else ""
        return f"{self.file}{line}: {self._dotted(key)}"

    def _dotted(self, key: str) -> str:
        return ".".join(part for part in (self.path, key) if part)

    @contextmanager
    def reading(self, file: str) -> Iterator[None]:
        """Prefix errors of an analysis of its signals with the place of the table and a file."""
        try:
            yield
        except CampaignError as error:
            if str(error).startswith(f"{self.file}:"):
                raise  # the error has its place already
            raise CampaignError(f"{self.where()} ({file}): {error}") from None

    def take(self, key: str, kind: type, default: Any = _REQUIRED) -> Any:
        """Value of a key, which must be of one type; without a default, the key is required."""
        self.known.add(key)
        if key not in self.values:
            if default is _REQUIRED:
                raise self._missing(key, _EXAMPLE.get(key, "..."))
            return default
        value = self.values[key]
        if type(value) is not kind:
            raise self.problem(key, f"must be {_WORDS[kind]}")
        return value

    def _missing(self, key: str, example: str) -> CampaignError:
        close = difflib.get_close_matches(key, set(self.values) - self.known, 1)
        remedy = f'found "{close[0]}": call it {key}' if close else f"add {key} = {example}"
        return self.problem(key, f"is missing; {remedy}")

    def choice(self, key: str, choices: Collection[str]) -> str:
        """Text of a key, which must be one of `choices`."""
        if key not in self.values:
            self.known.add(key)
            raise self._missing(key, " or ".join(f'"{item}"' for item in choices) or "...")
        value: str = self.take(key, str)
        if value not in choices:
            listed = ", ".join(f'"{item}"' for item in choices)
            close = difflib.get_close_matches(value, choices, 1)
            raise self.problem(key, f"must be one of {listed}" + (f'; did you mean "{close[0]}"?' if close else ""))
        return value

    def converted(
        self, key: str, read: Callable[[object], Value], default: Value | None = None, *, example: str = "..."
    ) -> Value:
        """Value of a key after conversion; a ValueError of the conversion becomes an error about the key.

        Parameters
        ----------
        key
            Key.
        read
            Conversion of the value in the file.
        default
            Value if the key is missing; None if the key is required.
        example
            Example of a value, without quotes, for the message about a missing key.
        """
        self.known.add(key)
        if key not in self.values:
            if default is not None:
                return default
            raise self._missing(key, f'"{example}"')
        try:
            return read(self.values[key])
        except ValueError as error:
            raise self.problem(key, str(error)) from None

    def table(self, key: str, *, required: bool = True) -> "TomlTable":
        """Table at a key; an empty table if the key is missing and not required."""
        return self.within(key, self.take(key, dict, _REQUIRED if required else {}))

    def within(self, key: str, values: Mapping[str, Any]) -> "TomlTable":
        """Table of the given values, with the position of a key."""
        return TomlTable(file=self.file, path=self._dotted(key), values=values, at=(*self.at, key), lines=self.lines)

    def tables(self, key: str, *, required: bool = True) -> tuple["TomlTable", ...]:
        """Array of tables at a key; their paths count from 1."""
        values = self.take(key, list, _REQUIRED if required else [])
        if not all(isinstance(item, dict) for item in values) or (required and not values):
            raise self.problem(key, f"must be tables; write [[{key}]] above the keys of each", show=False)
        return tuple(
            TomlTable(file=self.file, path=f"{key}[{number + 1}]", values=item, at=(key, number), lines=self.lines)
            for number, item in enumerate(values)
        )

    def finish(self) -> None:
        """Refuse keys that were not read."""
        for key in self.values:
            if key not in self.known:
                close = difflib.get_close_matches(key, self.known, 1)
                hint = f'did you mean "{close[0]}"?' if close else f"known here: {', '.join(sorted(self.known))}"
                raise self.problem(key, f"unknown key; {hint}")


def _shorten(value: object) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


_WORDS = {
    int: "a whole number, without quotes",
    str: 'text in quotes, e.g. "name"',
    list: "a list",
    dict: "a table of keys",
    bool: "true or false",
}
#: Examples of values of required keys, for messages about missing keys.
_EXAMPLE = {
    "schema": "1",
    "name": '"..."',
    "file": '"stepped.csv"',
    "line": '"..."',
    "unit": '"m"',
    "cells": '["...", "..."]',
    "tangential": '"..."',
    "normal": '"..."',
    "columns": 'a table of the columns, such as { frequency = "f" }',
    "convention": 'a table [convention] with time = "exp(+i omega t)" and amplitude = "peak"',
    "units": 'a table [units] with level = "N" and frequency = "Hz"',
    "sensor": "a table [[sensor]]",
    "test": "a table [[test]]",
}
