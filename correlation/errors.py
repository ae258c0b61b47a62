"""Errors of models that are compared with measurements, and of campaigns."""

from collections.abc import Callable
from typing import TypeVar

from geometry.errors import InputError

T = TypeVar("T")
U = TypeVar("U")


class ModelDefinitionError(InputError):
    """A model that contradicts itself: a sensor, line or part that does not fit the structure."""


class CampaignError(InputError):
    """A campaign folder that cannot be used; the message names the file, the field, the value and the remedy."""


class CampaignMistakes:
    """Mistakes of a campaign that do not follow from each other, reported together."""

    def __init__(self) -> None:
        self._messages: list[str] = []

    def attempt(self, make: Callable[[], T], instead: U) -> T | U:
        """Result of a function; its mistake is noted, and a substitute returned."""
        try:
            return make()
        except CampaignError as error:
            self._messages.append(str(error))
            return instead

    def add(self, sentence: str) -> None:
        """Note one."""
        self._messages.append(sentence)

    def refuse(self) -> None:
        """Stop if there are any.

        Raises
        ------
        CampaignError
            With all of them, one per line.
        """
        if self._messages:
            raise CampaignError("\n".join(dict.fromkeys(self._messages)))
