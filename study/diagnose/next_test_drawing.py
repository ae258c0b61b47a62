"""Figure of the advice on the next test."""

import numpy as np

from figure.next_test import NextTests, PredictedCurve, TestBar
from study.diagnose.next_test import NextStep

#: Sizes of readings, with the prefix of their unit.
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def make_next_tests(step: NextStep, title: str, units: dict[str, str]) -> NextTests:
    """Bars of the tests, and curves of the advised one.

    Parameters
    ----------
    step
        Advice.
    title
        Title of the figure.
    units
        Unit of each sensor, by name; that of the first for a further one.
    """
    assert step.advice is not None
    curve = step.advice.best.curve
    assert curve is not None
    sizes = np.abs(curve.value)
    unit = units.get(curve.sensor, next(iter(units.values()), "m"))
    largest = float(np.nanmax(sizes, initial=0.0)) or 1.0
    scale, prefix = next((pair for pair in PREFIXES if largest >= pair[0]), PREFIXES[-1])
    harmonic = "" if curve.harmonic == 1 else f", harmonic {curve.harmonic}"
    names = zip(step.advice.names, step.advice.probabilities, strict=True)
    return NextTests(
        title=title, subtitle=f"{step.sentence[0].upper()}{step.sentence[1:]}",
        tests=[
            TestBar(name=item.test.title, probability=item.probability, minutes=item.test.minutes)
            for item in step.shown
        ],
        frequency=curve.frequency,
        curves=[
            PredictedCurve(
                label=f"{name} ({100 * share:.0f} % so far)", size=size / scale, deviation=curve.deviation / scale
            )
            for (name, share), size in zip(names, sizes, strict=True)
        ],
        reading=f"{curve.sensor}{harmonic} at {curve.level:g} {step.unit} [{prefix}{unit}]",
    )  # fmt: skip
