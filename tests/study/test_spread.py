"""`stickslip spread`: derivatives against differences, the spread of an oscillator against its closed form."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from casefile.errors import CaseError
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from study import cli
from study.kind.registry import open_case
from study.run_context import silent_run
from study.spread.band import compute_upper_envelope
from study.spread.spread import spread
from study.spread.uncertain import read_uncertain
from study.sweep.samples import point_model
from tests.slow import slow
from tests.study.rubbing_mass import CASE as RUBBING_MASS
from tests.study.rubbing_mass import LIMITS, write_matrices

CASE = f"""{RUBBING_MASS}
quantity = "velocity"
gain = 2
[harmonics]
highest = 3
[sweep]
from = "150 Hz"
to = "195 Hz"
levels = [LEVEL]
"""


def uncertain(parameter: str, distribution: str, keys: str) -> str:
    return f'[[uncertain]]\nparameter = "{parameter}"\ndistribution = "{distribution}"\n{keys}\n'


FIVE = "".join(
    uncertain(parameter, "normal", f"{mean}\nrelative_sd = 0.1")
    for parameter, mean in (
        ("mu", "mean = 1.1"),
        ("kt", "mean = 1"),
        ("zeta", "mean = 0.9"),
        ("wall.preload", 'mean = "4 N"'),
        ("mass.gain", "mean = 2"),
    )
)
#: Of the linear oscillator: amplitude of the load and damping.
TWO = uncertain("load[0].amplitude", "lognormal", 'mean = "1 N"\nsd = "0.3 N"') + uncertain(
    "zeta", "uniform", "from = 0.5\nto = 1.5"
)


@pytest.fixture
def home(at_home: Path) -> Path:
    write_matrices(at_home)
    return at_home


def write(home: Path, level: float, more: str) -> Path:
    file = home / "my.toml"
    file.write_text(CASE.replace("LEVEL", f"{level:g}") + more)
    return file


def test_derivatives_of_a_slipping_curve_equal_central_differences(home: Path) -> None:
    file = write(home, 2, FIVE)
    result = spread(file, draws=0)
    opened = open_case(file)
    known = read_uncertain(opened)
    assert result.sampled.curves is not None
    curve = result.sampled.curves.curves[0][0]
    amplitudes = result.sensitivities[0].amplitude[:, 0]
    for number, mean in enumerate(known.mean):
        for point in range(3, len(curve.frequency), 9):
            omega, ends = 2 * np.pi * curve.frequency[point], []
            for side in (-1, 1):
                values = known.mean.copy()
                values[number] = mean * (1 + side * 1e-5)
                model = point_model(opened, known.at(values.tolist()), silent_run())
                balance = HarmonicBalance(system=model.system, n_harmonic=4).at_level(2)
                state = steady_state(balance, omega)
                ends.append(omega * abs(state.coefficients[1] @ model.outputs[0].row))
            difference = (ends[1] - ends[0]) / (2e-5 * mean)
            # Newton's method stops at 1e-9 of the motion, which differences over 2e-5 turn into 1e-4.
            scale = abs(curve.response[0, point]) / mean
            assert amplitudes[number, point] == pytest.approx(difference, rel=1e-4, abs=1e-4 * scale), (number, point)


def test_derivatives_of_refined_points_are_those_of_many_harmonics(home: Path) -> None:
    file = write(home, 2, uncertain("mu", "normal", "mean = 1.1\nsd = 0.1"))
    file.write_text(file.read_text().replace("highest = 3", 'highest = 3\ntolerance = "0.02 %"'))
    result = spread(file, draws=0)
    opened = open_case(file)
    known = read_uncertain(opened)
    assert result.sampled.curves is not None
    curve = result.sampled.curves.curves[0][0]
    for point in range(3, len(curve.frequency), 9):
        omega, ends = 2 * np.pi * curve.frequency[point], []
        for mu in (1.1 - 1e-4, 1.1 + 1e-4):
            model = point_model(opened, known.at([mu]), silent_run())
            state = steady_state(HarmonicBalance(system=model.system, n_harmonic=40).at_level(2), omega)
            ends.append(omega * abs(state.coefficients[1] @ model.outputs[0].row))
        slope, largest = (ends[1] - ends[0]) / 2e-4, np.abs(result.sensitivities[0].amplitude[0, 0]).max()
        # Slopes converge more slowly than amplitudes: 0.5 % here, and 2 % with 3 harmonics everywhere.
        assert result.sensitivities[0].amplitude[0, 0, point] == pytest.approx(slope, abs=0.01 * largest), point


def test_derivatives_of_the_peak_equal_differences_of_whole_curves(home: Path) -> None:
    peaks = []
    for factor in (0.999, 1.001):
        file = write(home, 2, uncertain("mu", "normal", f"mean = {1.1 * factor}\nsd = 0.1"))
        peaks.append([item.nominal for item in spread(file, draws=0).quantities])
    result = spread(write(home, 2, uncertain("mu", "normal", "mean = 1.1\nsd = 0.1")), draws=0)
    for number in (0, 1):
        difference = (peaks[1][number] - peaks[0][number]) / (0.002 * 1.1)
        # The points of the two curves differ, and with them the parabola through the highest ones: by 3 % here.
        assert result.quantities[number].slope[0] == pytest.approx(difference, rel=0.05)


@slow
def test_the_spread_of_a_linear_oscillator_has_its_closed_form(home: Path) -> None:
    file = write(home, 0.01, TWO)
    # It is linear, and higher harmonics would only take their time.
    file.write_text(file.read_text().replace("highest = 3", "highest = 1"))
    result = spread(file, draws=32)
    amplitude = next(item for item in result.quantities if item.name == "peak amplitude")
    # Amplitude = a F / z with a constant a; F is lognormal, z uniform from 0.5 to 1.5.
    f_mean, f_square, y_mean, y_square = 1.0, 1.09, np.log(3), 4 / 3
    variance = f_square * y_square - (f_mean * y_mean) ** 2
    scale = amplitude.nominal
    # sqrt(1 - zeta^2) and the band of frequencies matter by 1e-4; 64 Sobol draws leave about 1 / 64 of the mean.
    assert amplitude.mean == pytest.approx(scale * y_mean, rel=0.015)
    # A standard deviation by 64 draws is known to 1 / sqrt(128) at random, by Sobol points better.
    assert amplitude.deviation == pytest.approx(scale * np.sqrt(variance), rel=0.06)
    # First order: dA/dF = A, dA/dz = -A at z = 1; the parabola is exact for one mode up to velocity over displacement.
    np.testing.assert_allclose(amplitude.slope, [scale, -scale], rtol=2e-3)
    assert amplitude.first_order_deviation == pytest.approx(scale * np.sqrt(0.09 + 1 / 12), rel=2e-3)
    np.testing.assert_allclose(amplitude.linear_share, np.array([0.09, 1 / 12]) / (0.09 + 1 / 12), rtol=4e-3)
    assert amplitude.indices is not None
    y_variance = y_square - y_mean**2
    total = np.array([0.09 * y_square, y_variance * f_square]) / variance
    first = np.array([0.09 * y_mean**2, y_variance * f_mean**2]) / variance
    # An average of 32 products of order one is known to 1 / sqrt(32).
    np.testing.assert_allclose(amplitude.indices.total, total, atol=0.18)
    np.testing.assert_allclose(amplitude.indices.first, first, atol=0.18)
    damping = next(item for item in result.quantities if item.name == "equivalent damping ratio")
    # zeta = z c / (2 m omega0), evenly between its ends: known to one of 64 steps.
    zeta = 100 * 20 / (2 * np.sqrt(1.3e6))
    np.testing.assert_allclose(damping.quantiles, zeta * np.array([0.55, 1.0, 1.45]), atol=zeta / 64)
    assert damping.indices is not None
    # All of it is damping's; squares of differences of uniform draws scatter by 1.2 / sqrt(32) = 0.21.
    assert damping.indices.total[0] < 0.01 < 0.7 < damping.indices.total[1]
    # Far below the resonance damping does nothing: the band is that of the force.
    band = result.bands[0]
    low = band.quantiles[0, :, 0] / band.nominal[0, 0]
    sigma = np.sqrt(np.log(1.09))
    expected = np.exp(-sigma * sigma / 2 + sigma * 1.645 * np.array([-1, 0, 1]))
    # Of 64 evenly spread draws, 3.2 lie beyond either end.
    np.testing.assert_allclose(low, expected, rtol=0.05)


def test_the_files_agree_and_limits_spread_too(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write(home, 2, uncertain("mu", "normal", "mean = 1\nsd = 0.1") + LIMITS)
    assert cli.main(["spread", "my.toml", "--draws", "2", "--out", "out", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    assert {Path(file).name for file in document["files"]} == {file.name for file in (home / "out").iterdir()}
    assert {Path(file).name for file in document["files"] if file.endswith("png")} == {
        f"my_spread_{name}.png" for name in ("band", "limits", "shares", "limit_shares")
    }
    assert document["n_point"] == 1 + 2 * 3
    data = xr.open_dataset(home / "out" / "my_spread.nc", engine="h5netcdf")
    names = [f"{item['curve']}: {item['quantity']}" for item in document["quantities"]]
    assert data["quantity"].values.tolist() == names
    assert data["nominal"].values.tolist() == [item["at_the_means"] for item in document["quantities"]]
    assert data.sizes["limit_frequency"] == 2
    with (home / "out" / "my_spread.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    # The CSV has ten digits.
    assert float(rows[1]["95 %"]) == pytest.approx(document["quantities"][1]["quantiles"]["0.95"], rel=1e-9)
    upper = next(item for item in document["quantities"] if item["quantity"] == "upper limit")
    assert upper["standard_deviation"] > 0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('distribution = "normal"\nsd = 0.1', r"uncertain\[0\]: a normal distribution needs a mean: add mean"),
        ('distribution = "uniform"', r"a uniform distribution needs a mean: .* or from and to"),
        ('distribution = "normal"\nmean = 1', r"needs a standard deviation: give either sd"),
        ('distribution = "normal"\nmean = 1\nsd = -0.1', r"uncertain\[0\]\.sd = -0\.1: must be positive"),
        ('distribution = "normal"\nmean = 1\nsd = 0', r"uncertain\[0\]\.sd = 0: must be positive"),
        ('distribution = "normal"\nmean = 1\nsd = "2 N"', r'2 is in "N", but the other values are a bare number'),
        ('distribution = "normal"\nmean = 1\nsd = 1\nfrom = 0', r"from is not used for a normal distribution"),
        (
            'distribution = "lognormal"\nmean = -1\nsd = 1',
            r"mean = -1: a lognormal distribution has only positive values",
        ),
        ('distribution = "uniform"\nfrom = 2\nto = 1', r"from = 2 is not below to = 1"),
        ('distribution = "uniform"\nfrom = 2', r"has only one bound: add to"),
        ('distribution = "uniform"\nfrom = 1\nto = 2\nmean = 1', r"from and to or by mean and sd"),
        ('distribution = "gauss"\nmean = 1\nsd = 1', r'distribution = "gauss": must be "normal", "lognormal" or'),
        (
            'distribution = "normal"\nmean = 1\nsd = 0.5',
            r"mu = -.* of this normal distribution is not a valid value of the case",
        ),
        (
            'distribution = "uniform"\nfrom = -1\nto = 1',
            r"mu = 0 of this uniform distribution is not a valid value of the case",
        ),
    ],
)
def test_a_distribution_that_cannot_be_is_refused_in_one_sentence(home: Path, keys: str, message: str) -> None:
    file = write(home, 2, f'[[uncertain]]\nparameter = "mu"\n{keys}\n')
    with pytest.raises(CaseError, match=message) as refused:
        spread(file)
    assert len(str(refused.value).splitlines()) == 1
    text = file.read_text().splitlines()
    first, last = text.index("[[uncertain]]") + 1, len(text)
    assert first <= int(str(refused.value).removeprefix(f"{file}:").split(":")[0]) <= last


@pytest.mark.parametrize(
    ("more", "options", "message"),
    [
        ("", {}, r"there is no \[\[uncertain\]\].*: add one"),
        (uncertain("nu", "normal", "mean = 1\nsd = 0.1"), {}, r'parameter = "nu": the case has no such parameter; did'),
        (uncertain("mu", "normal", "mean = 1\nsd = 0.1") * 2, {}, r"named twice"),
        (uncertain("bearing", "normal", "mean = 1\nsd = 0.1"), {}, r"bearing: it is a factor"),
        (uncertain("wall.preload", "normal", "mean = 4\nsd = 1"), {}, r"preload = 4\.0: give a unit"),
        (TWO, {"draws": 48}, r"draws = 48: a Sobol sequence needs a power of two"),
        (TWO, {"draws": -2}, r"draws = -2"),
        (TWO, {"draws": 8192}, r"draws = 8192 of 2 parameters need 32768 points, but at most 20000 are"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(
    home: Path, more: str, options: dict[str, int], message: str
) -> None:
    with pytest.raises(CaseError, match=message) as refused:
        spread(write(home, 2, more), **options)
    assert len(str(refused.value).splitlines()) == 1


def test_an_envelope_takes_the_highest_of_a_fold_and_is_unknown_beyond_its_ends() -> None:
    along, amplitude = np.array([0.0, 2.0, 1.0, 3.0]), np.array([0.0, 4.0, 1.0, 3.0])
    result = compute_upper_envelope(along, amplitude, np.array([-1.0, 0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0]))
    np.testing.assert_array_equal(result, [np.nan, 0.0, 2.0, 3.0, 4.0, 2.5, 3.0, np.nan])
