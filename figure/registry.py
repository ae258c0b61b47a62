"""Figures, found rather than listed: each declares the result that it draws, so that commands need no list of them.

A figure is a file with a function from a result to a Matplotlib figure, registered by `draws`::

    @draws(ResponseCurves, "spectrum")
    def spectrum_figure(result: ResponseCurves) -> Figure: ...

Results are dataclasses of arrays, and of labels with units; each is in the file of its built-in figure. An external
figure appears in the output folder of every command with a result of its kind.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from figure.style import Figure, png
from geometry.errors import InputWarning
from geometry.registry import Registry


@dataclass(frozen=True, kw_only=True)
class FigureKind:
    """A kind of figure.

    Parameters
    ----------
    name
        Name of its files, in lower case with underscores.
    draws
        Class of the results that it draws.
    draw
        Makes the figure of a result.
    """

    name: str
    draws: type
    draw: Callable[[Any], Figure]

    @property
    def is_own(self) -> bool:
        """Whether it is the built-in figure of its result."""
        return self.draws.__module__ == self.draw.__module__

    def file_name(self, result: str) -> str:
        """File name for a named result, followed by the name of the figure unless that is the built-in one."""
        return result if self.is_own else f"{result}_{self.name}"


def _wrong(kind: Any) -> str | None:
    if not isinstance(kind.draws, type):
        return f"draws = {kind.draws!r}, which is not a class: name the class of the results that it draws"
    if not callable(kind.draw):
        return f"has draw = {kind.draw!r}, which cannot be called: give a function from a result to a figure"
    if not kind.name.isidentifier():
        return "cannot be part of a file's name: use letters, digits and underscores"
    return None


REGISTRY: Registry[FigureKind] = Registry(
    "figure",
    package="figure",
    group="stickslip.figures",
    facts={"draws": "the class of the results that it draws", "draw": "a function from a result to a figure"},
    check=_wrong,
)


R = TypeVar("R")


def draws(result: type[R], name: str) -> Callable[[Callable[[R], Figure]], Callable[[R], Figure]]:
    """A decorator that registers a function as the figure of a class of results, with a name for its files."""

    def registered(draw: Callable[[R], Figure]) -> Callable[[R], Figure]:
        REGISTRY.register(FigureKind(name=name, draws=result, draw=draw), depth=2)
        return draw

    return registered


def pictures(results: Mapping[str, object]) -> dict[str, bytes]:
    """Every figure of some results, as PNG by the name of its file.

    Parameters
    ----------
    results
        Results by name.

    Warns
    -----
    InputWarning
        An external figure fails: the others are drawn.
    """
    drawn: dict[str, bytes] = {}
    for name, result in results.items():
        # The figure that a result comes with is the first.
        for kind in sorted(REGISTRY, key=lambda item: not item.is_own):
            if not isinstance(result, kind.draws):
                continue
            try:
                drawn[kind.file_name(name)] = png(kind.draw(result))
            except Exception as error:
                if kind.is_own:
                    raise
                place = REGISTRY.entry(kind.name).place
                what = f'{place}: the figure "{kind.name}" of "{name}" fails ({type(error).__name__}: {error})'
                warnings.warn(f"{what}: correct it, or leave it out", InputWarning, stacklevel=2)
    return drawn
