"""The tables ``[[load]]``, ``[[static_load]]`` and ``[[dead_weight]]`` of a case."""

from typing import Annotated

from pydantic import Field

from casefile.quantity import Angle, Force
from study.case.joint_table import Name
from study.case.place import PlaceTable


class LoadTable(PlaceTable):
    """A harmonic force amplitude cos(harmonic Omega t + phase) at level 1."""

    amplitude: Annotated[Force, Field(ge=0)] = 1.0
    harmonic: Annotated[int, Field(strict=True, ge=1)] = 1
    phase: Angle = 0.0


class StaticLoadTable(PlaceTable):
    """A constant force."""

    force: Force


class DeadWeightTable(PlaceTable):
    """A constant force that presses lines; their preloads are those under it, so that it is not added to them."""

    name: Name
    force: Force
    presses: Annotated[tuple[Name, ...], Field(min_length=1, examples=[["left"]])]
