"""Comparison of a model with data other than steady states: loops, ring-downs, frequency responses, modes."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.data_type.registry import DATA_TYPES, Datum, Features, Panel
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.uncertainty.interval import TWO_SIDED_95
from figure.measured_data import MeasuredData
from geometry.plain_number import format_number
from study.compare.section.section import Section
from study.page.table import Table

COLUMNS = ("data", "type", "set", "quantity", "unit", "measured", "deviation", "predicted", "error_in_deviations")
#: A number with a larger error is reported in a sentence [standard deviations].
CLEAR_DEVIATION = 3.0
#: Number of panels of one figure.
MOST_PANELS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class DataComparison:
    """Comparison of one datum with a model.

    Parameters
    ----------
    name, type
        Name of the datum, and of its type.
    held_out
        Whether calibrations must not use it.
    features
        Measured numbers.
    predicted
        Predicted numbers, shape (m,); NaN where the model has no prediction.
    reason
        Why the datum could not be compared; empty if it was.
    coverage
        Part of the datum from which the numbers come, in words; empty for all of it.
    """

    name: str
    type: str
    held_out: bool
    features: Features
    predicted: Float[NDArray[np.float64], " m"]
    reason: str = ""
    coverage: str = ""

    @property
    def error(self) -> Float[NDArray[np.float64], " m"]:
        """Predicted less measured, shape (m,) [standard deviations]."""
        return np.asarray((self.predicted - self.features.value) / self.features.deviation)

    @property
    def root_mean_square(self) -> float:
        """Root mean square of the known errors [standard deviations]; NaN without any."""
        there = self.error[np.isfinite(self.error)]
        return float(np.sqrt(np.mean(there**2))) if len(there) else np.nan


def compare_data(model: Model, data: Sequence[Datum]) -> tuple[DataComparison, ...]:
    """Measured and predicted features of some data."""
    result = []
    for datum in data:
        kind = DATA_TYPES[datum.type]
        features, reason = kind.features(datum), ""
        try:
            predicted = kind.predict(model, datum)
        except CampaignError as error:
            predicted, reason = np.full(len(features.label), np.nan), str(error)
        result.append(
            DataComparison(
                name=datum.name,
                type=kind.name,
                held_out=datum.held_out,
                features=features,
                predicted=predicted,
                reason=reason,
                coverage=describe_coverage(datum),
            )
        )
    return tuple(result)


def describe_coverage(datum: Datum) -> str:
    """Part of a datum that gives numbers, in words; empty for all of it."""
    coverage = DATA_TYPES[datum.type].coverage
    return "" if coverage is None else coverage(datum)


def select_training_data(campaign: Campaign, model: Model) -> list[Datum]:
    """Data for a fit besides the steady states: not held out, not steady states themselves, and comparable."""
    names, data = [sensor.name for sensor in campaign.sensors], []
    for datum in campaign.data:
        kind = DATA_TYPES[datum.type]
        counts = kind.states is not None and kind.states(datum, names) is not None
        if datum.held_out or counts:
            continue
        try:
            kind.predict(model, datum)
        except CampaignError:
            continue  # said in the text, with its reason
        data.append(datum)
    return data


def describe_data(compared: Sequence[DataComparison]) -> list[str]:
    """Text with one paragraph per datum, with its numbers of largest error."""
    lines = []
    for item in compared:
        where = f"{item.type} {item.name}" + (" (held out)" if item.held_out else "")
        if item.reason:
            lines.append(f"{where}: not compared: {item.reason}")
            continue
        there = np.flatnonzero(np.isfinite(item.error))
        if not len(there):
            lines.append(f"{where}: the model has no prediction")
            continue
        far = there[np.argsort(-np.abs(item.error[there]))]
        lines.append(
            f"{where}: {len(there)} numbers, root mean square error {item.root_mean_square:.3g} standard deviations"
            + (f"; {len(item.error) - len(there)} without a prediction" if len(there) < len(item.error) else "")
        )
        lines += [f"  {item.coverage}"] if item.coverage else []
        lines += [f"  {_number(item, row)}" for row in far[:3] if abs(item.error[row]) > CLEAR_DEVIATION]
    return lines


def _number(item: DataComparison, row: int) -> str:
    features = item.features
    unit = "" if features.unit[row] == "-" else f" {features.unit[row]}"
    # A number that does not differ significantly from zero has no relative error.
    clear = abs(features.value[row]) > CLEAR_DEVIATION * features.deviation[row]
    relative = f" ({item.predicted[row] / features.value[row] - 1:+.2%})" if clear else ""
    half = format_number(TWO_SIDED_95 * features.deviation[row])
    return (
        f"{features.label[row]}: measured {format_number(features.value[row], 5)} +- {half}{unit}, "
        f"model {format_number(item.predicted[row], 5)}{unit}{relative}"
    )


def without_comparison(compared: Sequence[DataComparison]) -> tuple[str, ...]:
    """Names of the data that could not be compared, or that the model does not predict."""
    return tuple(f"{item.type} {item.name}" for item in compared if not np.isfinite(item.error).any())


def document_data(compared: Sequence[DataComparison]) -> list[dict[str, Any]]:
    """Comparison for ``--json``."""
    return [
        {
            "name": item.name,
            "type": item.type,
            "held_out": item.held_out,
            "reason": item.reason,
            "coverage": item.coverage,
            "root_mean_square_error": item.root_mean_square,
            "numbers": [
                {"quantity": label, "unit": unit, "measured": value, "deviation": deviation, "predicted": predicted}
                for label, unit, value, deviation, predicted in zip(
                    item.features.label, item.features.unit, item.features.value.tolist(),
                    item.features.deviation.tolist(), item.predicted.tolist(), strict=True,
                )
            ],
        }
        for item in compared
    ]  # fmt: skip


def format_data_csv(compared: Sequence[DataComparison]) -> str:
    """Format a comparison as CSV, one line per number."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for item in compared:
        side = "held out" if item.held_out else "training"
        for row, label in enumerate(item.features.label):
            numbers = (item.features.value[row], item.features.deviation[row], item.predicted[row], item.error[row])
            texts = [f"{number:.7g}" if np.isfinite(number) else "" for number in numbers]
            writer.writerow([item.name, item.type, side, label, item.features.unit[row], *texts])
    return stream.getvalue()


def make_data_sections(compared: Sequence[DataComparison], drawn: Mapping[str, bytes]) -> tuple[Section, ...]:
    """Sections of a page: one per type, with its numbers and pictures.

    Parameters
    ----------
    compared
        Compared data.
    drawn
        Pictures of `make_data_figures`, by name.
    """
    sections = []
    for kind in DATA_TYPES:
        items = [item for item in compared if item.type == kind.name]
        if items:
            rows = [row for item in items for row in _format_rows(item)]
            pictures = {name: picture for name, picture in drawn.items() if name.rstrip("_0123456789") == kind.table}
            head = ("data", "set", "quantity", "unit", "measured", "deviation", "predicted", "error in deviations")
            reasons = " ".join(
                f"{item.name} was not compared: {item.reason}." if item.reason else f"{item.name}: {item.coverage}."
                for item in items
                if item.reason or item.coverage
            )
            sections.append(
                Section(
                    title=f"{kind.name[0].upper()}{kind.name[1:]}s",
                    text=f"{kind.holds[0].upper()}{kind.holds[1:]}: measured and predicted. {reasons}".strip(),
                    table=Table(head=head, rows=rows, words=4),
                    pictures=pictures,
                )
            )
    return tuple(sections)


def _format_rows(item: DataComparison) -> list[list[str]]:
    side, features = "held out" if item.held_out else "training", item.features
    return [
        [
            item.name, side, label, "" if features.unit[row] == "-" else features.unit[row],
            format_number(features.value[row], 5), format_number(features.deviation[row]),
            *(format_number(number, digits) if np.isfinite(number) else "" for number, digits in
              ((item.predicted[row], 5), (item.error[row], 3))),
        ]
        for row, label in enumerate(features.label)
    ]  # fmt: skip


def make_data_figures(model: Model, data: Sequence[Datum], title: str) -> dict[str, object]:
    """Results to draw, by name: measured and predicted curves of each type, eight panels per figure."""
    drawn: dict[str, object] = {}
    for kind in DATA_TYPES:
        if kind.panels is None:
            continue
        panels: list[Panel] = []
        for datum in data:
            if datum.type == kind.name:
                try:
                    panels += kind.panels(model, datum)
                except CampaignError:
                    continue  # said in the text, with its reason
        for first in range(0, len(panels), MOST_PANELS):
            number = "" if len(panels) <= MOST_PANELS else f"_{first // MOST_PANELS + 1}"
            drawn[f"{kind.table}{number}"] = MeasuredData(
                panels=panels[first : first + MOST_PANELS],
                title=f"{title}: {kind.name}s",
                subtitle="measured and model",
            )
    return drawn
