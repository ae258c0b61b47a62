"""Datasets 15 and 2411: coordinates of nodes."""

import math

import numpy as np

from correlation.file.column import Node
from correlation.file.number import read_numbers
from correlation.file.uff.dataset import Dataset
from correlation.file.uff.record import read_fields, read_integers
from correlation.file.uff.units import FileUnits


def read_nodes(dataset: Dataset, units: FileUnits) -> dict[int, Node]:
    """Read the nodes of dataset 15, one line each, or of dataset 2411, two lines each.

    Parameters
    ----------
    dataset
        Dataset.
    units
        Units of the file.

    Returns
    -------
    Coordinates by the number of the node, each of shape (3,) [m].

    Raises
    ------
    CampaignError
        A line cannot be read, or a node appears twice with different coordinates.
    """
    nodes: dict[int, Node] = {}
    rows = [row for row, line in enumerate(dataset.lines) if line.strip()]
    step = 1 if dataset.kind == 15 else 2
    for row, following in zip(rows[::step], rows[step - 1 :: step], strict=False):
        if step == 1:
            number, *_, x, y, z = read_fields(dataset, row, (10, 10, 10, 10, 13, 13, 13), "iiiieee")
            point = np.array([x, y, z], dtype=np.float64)
        else:
            number = read_integers(dataset, row, (10, 10, 10, 10))[0]
            coordinates = read_numbers(dataset.lines[following])
            if coordinates is None or len(coordinates) != 3:
                raise dataset.error(following, f'"{dataset.text(following).strip()[:60]}" are not three coordinates')
            point = coordinates
        with np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused below
            point = point * units.metre
        if not all(map(math.isfinite, point)) or int(number) <= 0:
            raise dataset.error(row, f'"{dataset.text(row).strip()[:60]}" is not a node with three coordinates')
        if int(number) in nodes and not np.array_equal(nodes[int(number)], point):
            raise dataset.error(row, f"node {number} appears twice, at different places; remove one")
        nodes[int(number)] = point
    if len(rows) % step:
        raise dataset.error(rows[-1], "the last node has no coordinates; is the file cut?")
    return nodes
