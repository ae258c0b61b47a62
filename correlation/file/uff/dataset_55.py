"""Dataset 55: values at nodes, such as mode shapes."""

import math

import numpy as np

from correlation.file.column import MeasuredShape
from correlation.file.uff.dataset import Dataset
from correlation.file.uff.record import read_integers, read_reals
from correlation.file.uff.units import FileUnits

KINDS = {
    0: "unknown", 1: "static", 2: "normal mode", 3: "complex mode", 4: "transient", 5: "frequency response",
    6: "buckling", 7: "complex mode",
}  # fmt: skip
COMPLEX = 5


def read_shape(dataset: Dataset, units: FileUnits) -> MeasuredShape:
    r"""Read the values at nodes.

    The eigenvalue :math:`\lambda` of a complex mode gives the frequency :math:`|\lambda| / 2 \pi` and the damping ratio
    :math:`-\operatorname{Re} \lambda / |\lambda|`.

    Raises
    ------
    CampaignError
        The header cannot be read, or a node has another number of values than stated in the header.
    """
    _, analysis, _, quantity, kind, width = read_integers(dataset, 5, (10,) * 6)
    if analysis not in KINDS or kind not in {2, COMPLEX} or not 1 <= width <= 9:
        raise dataset.error(
            5, f"analysis type {analysis}, data type {kind} or {width} values per node is unknown; export it again"
        )
    n_integer, n_real = read_integers(dataset, 6, (10, 10))
    if not (0 <= n_integer <= 10 and 0 <= n_real <= 12):
        raise dataset.error(6, f"{n_integer} whole and {n_real} real parameters are not possible")
    whole = read_integers(dataset, 6, (10,) * (2 + min(n_integer, 6)))[2:]
    row, real = 7 + max(0, math.ceil((n_integer - 6) / 8)), np.zeros(0)
    while len(real) < n_real:
        numbers = read_reals(dataset, row)
        if numbers is None or not len(numbers):
            raise dataset.error(row, f'"{dataset.text(row).strip()[:60]}" are not real parameters')
        real, row = np.concatenate([real, numbers]), row + 1
    frequency, damping = _read_frequency_and_damping(analysis, real)
    nodes, values = _read_values(dataset, row, width, kind == COMPLEX)
    facts = {f"line {line + 1}": dataset.text(line).strip() for line in range(5)}
    if analysis in {2, 3, 7} and len(whole) > 1:
        facts["mode"] = str(whole[1])
    return MeasuredShape(
        kind=KINDS[analysis],
        frequency=frequency,
        damping_ratio=damping,
        nodes=nodes,
        values=values,
        unit=units.of_type(quantity),
        facts={key: text for key, text in facts.items() if text and text.upper() != "NONE"},
        where=dataset.where(),
    )


def _read_frequency_and_damping(analysis: int, real: np.ndarray) -> tuple[float, float]:
    given = [*real.tolist(), *[math.nan] * 4]
    if analysis in {3, 7}:
        size = math.hypot(given[0], given[1])
        return size / (2 * math.pi), -given[0] / size if size else math.nan
    if analysis == 2:
        viscous, hysteretic = given[2], given[3]
        return given[0], viscous or (hysteretic / 2 if hysteretic > 0 else viscous)
    return (given[0] if analysis == 5 else math.nan), math.nan


def _read_values(dataset: Dataset, start: int, width: int, has_phase: bool) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the nodes, and their values, at most six per node."""
    needed = width * (2 if has_phase else 1)
    rows = [row for row in range(start, len(dataset.lines)) if dataset.lines[row].strip()]
    nodes: list[int] = []
    values: list[np.ndarray] = []
    lines = math.ceil(needed / 6)
    for begin in range(0, len(rows), lines + 1):
        row = rows[begin]
        nodes.append(read_integers(dataset, row, (10,))[0])
        parts = [read_reals(dataset, index) for index in rows[begin + 1 : begin + 1 + lines]]
        known = [part for part in parts if part is not None]
        numbers = np.concatenate(known) if known else np.zeros(0)
        if len(known) < len(parts) or len(numbers) != needed or len(dataset.lines[row].split()) != 1:
            count = "no numbers" if len(known) < len(parts) else f"{len(numbers)} values"
            raise dataset.error(row, f"node {nodes[-1]} has {count}, the header says {needed}; is the file cut?")
        values.append(numbers)
    if len({*nodes}) < len(nodes):
        twice = next(node for node in nodes if nodes.count(node) > 1)
        raise dataset.error(start, f"node {twice} appears twice in one shape; remove one")
    table = np.array(values, dtype=np.float64).reshape(len(nodes), needed)
    table = table[:, ::2] + 1j * table[:, 1::2] if has_phase else table
    return np.array(nodes, dtype=np.int64), table[:, :6]
