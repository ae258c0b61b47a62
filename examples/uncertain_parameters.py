"""How exactly a response is known: a chain with a rubbing end over a grid, and over the distributions of two values."""

from pathlib import Path

import numpy as np

import stickslip as ss
from figure.registry import pictures
from study.shipped_cases import SOLVE
from study.spread.pictures import draw_spread
from study.sweep.pictures import draw_sweep

# The case of `stickslip solve`, with one level and the distributions of what is not known exactly.
UNCERTAIN = """
[[uncertain]]
parameter = "wall.friction_coefficient"
distribution = "lognormal"
mean = 0.4
relative_sd = "15 %"

[[uncertain]]
parameter = "zeta" # factor on the damping
distribution = "uniform"
from = 0.7
to = 1.3
"""
case = Path("chain.toml")
text = SOLVE.read_text(encoding="utf-8").replace("levels = [1, 4, 8, 16]", "levels = [1]")
case.write_text(text.replace("solve_chain.npz", str(SOLVE.with_suffix(".npz"))) + UNCERTAIN, encoding="utf-8")

# Every point of a grid is the case with these values in its file.
swept = ss.sweep(case, {"wall.friction_coefficient": "0.3:0.5:3", "wall.preload": ["15 N", "20 N"]})
for values, curves in zip(swept.sampled.values, swept.sampled.curves.curves, strict=True):
    peak = curves[0].peak(0)
    print(f"mu = {values[0]:g}, N0 = {values[1]:g} N: {1e6 * peak.amplitude:.2f} um at {peak.parameter:.2f} Hz")

# n (d + 2) = 64 curves.
spread = ss.spread(case, draws=16)
amplitude = next(item for item in spread.quantities if item.name == "peak amplitude")
low, middle, high = amplitude.quantiles
print(f"peak amplitude: {middle:.2f} um, 5 to 95 %: {low:.2f} to {high:.2f} um")
print(f"standard deviation: {amplitude.deviation:.2f} um, to first order {amplitude.first_order_deviation:.2f} um")
for parameter, share in zip(spread.uncertain.parameters, amplitude.indices.total, strict=True):
    print(f"share of the variance by {parameter.name}: {share:.2f}")

for name, picture in pictures(draw_sweep(swept.grid, swept.sampled, "Chain over a grid")).items():
    Path(f"{name}.png").write_bytes(picture)
    print(f"drawn in {name}.png")
for name, picture in pictures(draw_spread(spread, "Chain with uncertain friction")).items():
    Path(f"{name}.png").write_bytes(picture)
    print(f"drawn in {name}.png")

# The amplitude of a sliding contact grows with what it can carry, mu N0: products of both are the same.
first, second = (
    next(
        curves[0].peak(0).amplitude
        for values, curves in zip(swept.sampled.values, swept.sampled.curves.curves, strict=True)
        if np.allclose(values, wanted)
    )
    for wanted in ((0.3, 20), (0.4, 15))
)
print(f"mu N0 = 6 N: {1e6 * first:.3f} and {1e6 * second:.3f} um")
assert np.isclose(first, second, rtol=0.05)
# A narrow distribution spreads the peak to first order, here within a fifth.
assert np.isclose(amplitude.deviation, amplitude.first_order_deviation, rtol=0.2)
assert amplitude.indices.total.argmax() == 0
