"""Folders of test files, and the manifests that are drafted of them."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.read_campaign import read_campaign
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from study.campaign.new_campaign import NewCampaign, draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions

FREQUENCY = np.linspace(90.0, 110.0, 41)
ONES = np.ones(41)


def receptance(frequency: NDArray[np.float64], natural: float = 100.0, ratio: float = 0.01) -> NDArray[np.complex128]:
    """Displacement per force of 1 kg, for e^{+i Omega t} [m/N]."""
    omega, omega_0 = 2 * np.pi * frequency, 2 * np.pi * natural
    return 1.0 / (omega_0**2 - omega**2 + 2j * ratio * omega_0 * omega)


def drafted(folder: Path) -> tuple[NewCampaign, dict[str, Any]]:
    """A draft of a folder with all assumptions; it can be read."""
    campaign = write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()))
    read_campaign(folder)
    return campaign, tomllib.loads(campaign.path.read_text())


def write_csv(path: Path, header: str, *columns: Any) -> None:
    rows = [
        ",".join(one if isinstance(one, str) else repr(float(one)) for one in row) for row in zip(*columns, strict=True)
    ]
    path.write_text("\n".join([header, *rows]) + "\n")


def write_histories(path: Path, time: NDArray[np.float64], **channels: tuple[NDArray[np.float64], str, str]) -> None:
    """A universal file of channels: values along the axis, unit and the direction in which each reads."""
    columns = [Column(name="time", values=time, unit="s")]
    for node, (name, (values, unit, direction)) in enumerate(channels.items(), start=1):
        columns.append(
            Column(
                name=name, values=-values if direction[0] == "-" else values, unit=unit, abscissa="time",
                function="time", response=Point(node=node, direction=direction),
            )
        )  # fmt: skip
    nodes = {1: np.array([0.0, 0.0, 0.1]), 2: np.array([0.5, 0.0, 0.1])}
    write_uff(MeasuredFile(path=path, format="", columns=tuple(columns), nodes=nodes), path, binary=True)
