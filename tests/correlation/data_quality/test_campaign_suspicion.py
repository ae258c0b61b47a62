"""What looks wrong is told with its evidence; what is right is not suspected."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.data_quality.campaign import find_suspicions
from correlation.data_quality.conjugate import find_conjugate_repeats, find_conjugate_tests
from correlation.data_quality.model import find_model_suspicions, find_swapped_sensors
from correlation.feature.table import extract_features

LEVELS = (1.0, 3.0, 10.0)
FREQUENCY = np.linspace(92.0, 108.0, 17)
SHAPE = {"tip": 1.0, "slot": 0.55, "mid": -0.16}


def response(level: float, frequency: float, f0: float = 100.0, zeta: float = 0.02) -> complex:
    """Of one mode; damping grows with the level, as friction does."""
    damping = zeta * level**0.2
    return level * 1e-6 / (1 - (frequency / f0) ** 2 + 2j * damping * frequency / f0)


def campaign(seed: int = 1, noise: float = 0.003, factor: float = 1.0) -> Campaign:
    """Three sensors of one mode, up and down, three repeats; harmonics 1 and 3."""
    rng = np.random.default_rng(seed)
    rows = []
    for sensor, gain in enumerate(SHAPE.values()):
        for level in LEVELS:
            for number, frequency in enumerate(FREQUENCY):
                for harmonic in (1, 3):
                    for repeat in (1, 2, 3):
                        for sweep in (1, -1):
                            x = gain * response(level, frequency) / harmonic**3
                            x *= 1 + noise * (rng.normal() + 1j * rng.normal())
                            order = number if sweep == 1 else 100 - number
                            rows.append((0, order, repeat, sweep, level, frequency * factor, sensor, harmonic, x))
    names = ("test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "value")
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    sensors = tuple(MeasuredSensor(name=name, quantity="displacement", direction="z", place=name) for name in SHAPE)
    return Campaign(
        title="",
        folder=Path(),
        sensors=sensors,
        tests=(Test(name="stepped"),),
        measurement=Measurement(**columns),
        held_out=HeldOut(),
    )


def with_values(made: Campaign, value: np.ndarray) -> Campaign:
    return replace(made, measurement=replace(made.measurement, value=value))


def sentences(made: Campaign) -> str:
    return "\n".join(map(str, find_suspicions(made)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.001, 0.03])
def test_a_sound_campaign_is_not_suspected(seed: int, noise: float) -> None:
    assert find_suspicions(campaign(seed, noise)) == ()


def test_a_band_below_the_resonance_is_not_taken_for_phases() -> None:
    made = campaign()
    below = made.measurement.where((made.measurement.frequency < 98) & (made.measurement.sensor < 2))
    assert (below.value.real > 0).all()  # as amplitudes are
    assert "phase" not in sentences(replace(made, measurement=below))


@pytest.mark.parametrize("convert", [np.degrees, np.asarray], ids=["degrees", "radians"])
@pytest.mark.parametrize("unit", [1.0, 1e-6], ids=["m", "um"])
def test_phases_in_the_imaginary_column_are_suspected(unit: float, convert: np.ufunc) -> None:
    made = campaign()
    value = made.measurement.value
    polar = unit * (np.abs(value) / unit + 1j * convert(np.angle(value)))
    result = sentences(with_values(made, polar))
    assert 'test "stepped", sensor "tip": real is never negative and from 1 to 10 N real grows' in result
    assert "are these amplitude and phase? Write real = amplitude cos(phase)" in result


def test_phases_at_a_single_level_are_suspected_by_their_size() -> None:
    made = campaign()
    one = made.measurement.where((made.measurement.level == 1.0) & (made.measurement.sensor == 0))
    polar = np.abs(one.value) + 1j * np.degrees(np.angle(one.value))
    result = sentences(replace(made, measurement=replace(one, value=polar)))
    assert "imag reaches" in result
    assert "amplitude and phase" in result


def test_a_constant_harmonic_is_suspected() -> None:
    made = campaign()
    table = made.measurement
    value = np.where((table.harmonic == 3) & (table.sensor == 2), 0.0, table.value)
    assert 'sensor "mid": harmonic 3 reads 0+0j m at all 306 points' in sentences(with_values(made, value))


def test_copied_repeats_are_suspected() -> None:
    made = campaign()
    assert "300 of" not in sentences(made)
    table = made.measurement
    order = np.lexsort((table.repeat, table.sweep, table.harmonic, table.sensor, table.frequency, table.level))
    table = table.where(order)
    value = table.value.copy()
    value[1::3] = value[0::3]  # repeat 2 is repeat 1
    copies = replace(made, measurement=replace(table, value=value))
    assert "102 of 204 pairs of repeats agree in every digit: are they copies?" in sentences(copies)


def test_few_equal_readings_of_many_are_chance() -> None:
    made = campaign()
    table = made.measurement
    value = table.value.copy()
    for frequency in FREQUENCY[:2]:  # in 2 of 204 pairs of the first sensor, and in none of the others
        rows = np.flatnonzero(
            (table.sensor == 0) & (table.harmonic == 1) & (table.frequency == frequency) & (table.sweep == 1)
        )
        value[rows[1]] = value[rows[0]]
    assert "agree in every digit" not in sentences(with_values(made, value))


@pytest.mark.parametrize("together", [True, False])
def test_sensors_at_one_place_are_suspected_if_a_test_has_two_of_them(together: bool) -> None:
    made = campaign()
    here = replace(made, sensors=tuple(replace(item, place="tip") for item in made.sensors))
    if not together:
        table = here.measurement
        tests = tuple(replace(here.tests[0], name=sensor.name) for sensor in here.sensors)
        here = replace(here, tests=tests, measurement=replace(table, test=table.sensor))
    (result,) = (item for item in find_suspicions(here) if 'at "tip" along z' in item.sentence)
    assert result.remark is not together


def test_a_missing_level_is_suspected() -> None:
    made = campaign()
    table = made.measurement
    left = table.where(~((table.level == 10.0) & (table.repeat == 2) & (table.sweep == -1)))
    result = sentences(replace(made, measurement=left))
    assert 'test "stepped": repeat 2, sweep down lacks the level 10 N, which others have' in result
    # Some states that were read twice are no run, and a branch need not be there at all levels.
    state = table.frequency == table.frequency[0]
    twice = table.where((table.repeat == 1) | (state & (table.repeat == 2) & (table.level == 10.0)))
    assert "lacks the level" not in sentences(replace(made, measurement=twice))
    branch = table.where((table.sweep == 1) | (table.level == 10.0))
    assert "lacks the level" not in sentences(replace(made, measurement=branch))


def test_frequencies_that_one_run_lacks_are_said_where_several_others_have_them() -> None:
    made = campaign()
    table = made.measurement
    aborted = (table.level == 10.0) & (table.repeat == 2) & (table.sweep == -1) & (table.frequency < 100)
    result = sentences(replace(made, measurement=table.where(~aborted)))
    assert "repeat 2, sweep down at 10 N lacks " in result
    assert " which others have: was it aborted?" in result
    point = aborted & (table.frequency == table.frequency[aborted][3])
    assert "lacks 1 of 17 frequencies" in (result := sentences(replace(made, measurement=table.where(~point))))
    assert "were points left out?" in result


@pytest.mark.parametrize("direction", [1, -1])
def test_short_sweeps_of_one_direction_or_of_most_repeats_are_planned(direction: int) -> None:
    made = campaign()
    table = made.measurement
    short = (table.sweep == direction) & (table.frequency < 100)
    assert " lacks " not in sentences(replace(made, measurement=table.where(~short)))
    short = (table.repeat > 1) & (table.frequency < 100)
    assert " lacks " not in sentences(replace(made, measurement=table.where(~short)))


def test_missing_points_of_a_sensor_are_suspected() -> None:
    made = campaign()
    table = made.measurement
    left = table.where(~((table.sensor == 1) & (table.harmonic == 3) & (table.frequency > 107)))
    result = sentences(replace(made, measurement=left))
    assert result.count("values where others have") == 1
    assert '288 values where others have 306: were some left out? It concerns "slot" (harmonic 3)' in result
    one = (table.sensor == 1) & (table.repeat == 2) & (table.level == 10.0)
    assert sentences(replace(made, measurement=table.where(~one))).count(", in repeat 2 at 10 N") == 1


def test_amplitudes_of_all_sensors_are_suspected_in_one_sentence() -> None:
    made = campaign()
    result = sentences(with_values(made, np.abs(made.measurement.value).astype(complex)))
    assert result.count("the imaginary part is zero") == 1
    assert all(f'sensor "{name}"' in result for name in SHAPE)


def test_sweeps_that_run_the_other_way_are_suspected() -> None:
    made = campaign()
    mixed = replace(made.measurement, sweep=-made.measurement.sweep)
    result = sentences(replace(made, measurement=mixed))
    assert "in sweeps up the frequency goes in the other direction, by the column order, in 144 of 144 steps" in result


def test_radians_per_second_labelled_hertz_are_suspected_beside_a_model() -> None:
    wrong = campaign(factor=2 * np.pi)
    (result,) = find_model_suspicions(wrong, [97.0, 610.0 / 1.5, 2500.0])
    assert result.where == 'test "stepped"'
    assert '"tip" peaks at 628.3 in the column frequency, which is 2 pi times the model' in result.sentence
    assert "resonance of 97 Hz" in result.sentence
    assert 'write "rad/s" instead of "Hz" as the unit of that column' in result.sentence


def test_hertz_labelled_radians_per_second_are_suspected_beside_a_model() -> None:
    (result,) = find_model_suspicions(campaign(factor=1 / (2 * np.pi)), [97.0])
    assert "a 2 pi-th of the model" in result.sentence
    assert 'write "Hz" instead of "rad/s" as the unit of that column' in result.sentence


def test_a_band_without_a_peak_is_compared_as_a_whole() -> None:
    made = campaign(factor=2 * np.pi)
    below = replace(made, measurement=made.measurement.where(made.measurement.frequency < 600))
    (result,) = find_model_suspicions(below, [97.0])
    assert "the column frequency covers 578.1 to 596.9" in result.sentence


@pytest.mark.parametrize("model", [[90.0], [110.0, 620.0], [20.0, 350.0], []])
def test_a_model_that_is_near_or_altogether_different_raises_no_suspicion(model: list[float]) -> None:
    assert find_model_suspicions(campaign(), model) == ()


@pytest.mark.parametrize(("i", "j"), [(0, 1), (0, 2), (1, 2)])
@pytest.mark.parametrize("f0", [100.0, 97.0, 103.0])
def test_swapped_sensors_are_found_though_the_resonance_is_off(i: int, j: int, f0: float) -> None:
    made = campaign()
    swap = np.arange(3)
    swap[[i, j]] = j, i
    swapped = replace(made, measurement=replace(made.measurement, sensor=swap[made.measurement.sensor]))
    for item, expected in ((made, 0), (swapped, 1)):
        table = extract_features(item)
        gain = np.array(list(SHAPE.values()))[table.sensor] / table.harmonic**3
        predicted = gain * [response(*point, f0) for point in zip(table.level, table.frequency, strict=True)]
        result = find_swapped_sensors(item, table, predicted)
        assert len(result) == expected
    names = list(SHAPE)
    assert result[0].where == f'sensors "{names[min(i, j)]}" and "{names[max(i, j)]}" look swapped'
    assert "the model says" in result[0].sentence
    assert "swapped, they agree within" in result[0].sentence


@pytest.mark.parametrize("f0", [100.0, 97.0])
def test_sensors_that_read_nearly_alike_are_found_where_a_third_one_confirms(f0: float) -> None:
    made = campaign()
    # 12 % apart; the third one is right.
    made = with_values(made, np.where(made.measurement.sensor == 1, 0.88 / 0.55, 1.0) * made.measurement.value)
    swap = np.array([1, 0, 2])
    swapped = replace(made, measurement=replace(made.measurement, sensor=swap[made.measurement.sensor]))
    alone = [replace(item, measurement=item.measurement.where(item.measurement.sensor < 2)) for item in (swapped, made)]
    for item, expected in ((made, 0), (swapped, 1), (alone[0], 0), (alone[1], 0)):
        table = extract_features(item)
        gain = np.array([1.0, 0.88, -0.16])[table.sensor] / table.harmonic**3
        predicted = gain * [response(*point, f0) for point in zip(table.level, table.frequency, strict=True)]
        assert len(find_swapped_sensors(item, table, predicted)) == expected


@pytest.mark.parametrize("errors", [(0.06, -0.06, 0.0), (0.06, -0.06, 0.03), (-0.1, 0.02, 0.05)])
def test_errors_of_mode_shapes_are_not_taken_for_a_swap(errors: tuple[float, ...]) -> None:
    made = campaign()
    made = with_values(made, np.where(made.measurement.sensor == 1, 0.97 / 0.55, 1.0) * made.measurement.value)
    table = extract_features(made)
    predicted = (1 + np.array(errors))[table.sensor] * table.value
    assert find_swapped_sensors(made, table, predicted) == ()


def test_a_wrong_gain_is_not_taken_for_a_swap() -> None:
    made = campaign()
    table = extract_features(made)
    predicted = np.where(table.sensor == 0, 1.3, 1.0) * table.value
    assert find_swapped_sensors(made, table, predicted) == ()


def predictions(made: Campaign, f0: float = 100.0) -> np.ndarray:
    """Of the model of one mode, at the features of a campaign."""
    table = extract_features(made)
    gain = np.array(list(SHAPE.values()))[table.sensor] / table.harmonic**3
    return np.asarray(gain * [response(*point, f0) for point in zip(table.level, table.frequency, strict=True)])


def test_forces_along_and_across_a_line_that_are_swapped_are_found() -> None:
    made = campaign()
    sensors = (
        replace(made.sensors[0], quantity="contact force", line="left", component="tangential"),
        replace(made.sensors[1], quantity="contact force", line="left", component="normal"),
        made.sensors[2],
    )
    swap = np.array([1, 0, 2])
    swapped = replace(made, measurement=replace(made.measurement, sensor=swap[made.measurement.sensor]))
    for item, expected in ((made, 0), (swapped, 1)):
        there = replace(item, sensors=sensors)
        assert len(find_swapped_sensors(there, extract_features(there), predictions(item))) == expected


def test_points_without_a_prediction_are_passed_over() -> None:
    made = campaign()
    swap = np.array([1, 0, 2])
    swapped = replace(made, measurement=replace(made.measurement, sensor=swap[made.measurement.sensor]))
    predicted = predictions(swapped)
    predicted[::7] = np.nan
    (result,) = find_swapped_sensors(swapped, extract_features(swapped), predicted)
    assert result.where == 'sensors "tip" and "slot" look swapped'


@pytest.mark.parametrize("f0", [100.0, 97.0, 103.0])
def test_the_other_sign_of_time_is_found_and_a_resonance_that_is_off_is_not_taken_for_it(f0: float) -> None:
    made = campaign()
    assert not list(find_conjugate_tests(made, extract_features(made), predictions(made, f0)))
    other = with_values(made, made.measurement.value.conj())
    result = find_conjugate_tests(other, extract_features(other), predictions(other, f0))
    if f0 == 100.0:
        (one,) = result
        assert one.where == 'test "stepped"'
        assert "the phases agree with the model to" in one.sentence
        assert "change the sign in convention.time of the manifest" in one.sentence


@pytest.mark.parametrize("f0", [100.0, 99.7])
def test_velocities_that_are_called_displacements_are_told_as_such_and_not_as_phases(f0: float) -> None:
    made = campaign()
    table = made.measurement
    called = with_values(made, 2j * np.pi * table.harmonic * table.frequency * table.value)
    result = list(find_conjugate_tests(called, extract_features(called), predictions(called, f0)))
    assert [item.where for item in result] == [f'test "stepped", sensor "{name}"' for name in SHAPE]
    assert all("those of a velocity in SI" in item.sentence for item in result)


@pytest.mark.parametrize(("f0", "expected"), [(100.0, 1), (85.0, 0), (97.0, 0), (120.0, 0)])
def test_phases_that_are_not_relative_to_the_force_are_turned_by_one_angle(f0: float, expected: int) -> None:
    made = campaign()
    assert not [
        item for item in find_conjugate_tests(made, extract_features(made), predictions(made, f0)) if item.of_test
    ]
    if expected:
        turned = with_values(made, np.exp(1.7j) * made.measurement.value)
        (result,) = find_conjugate_tests(turned, extract_features(turned), predictions(turned, f0))
        assert result.of_test
        assert "turned by -97 deg" in result.sentence
        small = with_values(made, np.exp(-0.5j) * made.measurement.value)
        (result,) = find_conjugate_tests(small, extract_features(small), predictions(small, f0))
        assert "turned by +29 deg" in result.sentence
        table = made.measurement
        late = with_values(made, np.exp(-2j * np.pi * table.harmonic * table.frequency * 1e-3) * table.value)
        (result,) = find_conjugate_tests(late, extract_features(late), predictions(late, f0))
        assert "is 1 ms at 100 Hz" in result.sentence


@pytest.mark.parametrize("f0", [100.0, 99.8])
@pytest.mark.parametrize("spoil", [np.conj, np.negative])
def test_a_single_sensor_with_phases_of_the_other_sign_is_found(spoil: np.ufunc, f0: float) -> None:
    made = campaign()
    table = made.measurement
    # Off resonance a conjugate number is none of the opposite sign.
    wide = (table.harmonic == 1) & (np.abs(table.frequency - 100.0) > 2.0)
    made = replace(made, measurement=table.where(wide))
    table = made.measurement
    one = with_values(made, np.where(table.sensor == 1, spoil(table.value), table.value))
    (result,) = find_conjugate_tests(one, extract_features(one), predictions(one, f0))
    assert result.where == 'test "stepped", sensor "slot"'
    assert ("imaginary" in result.sentence) == (spoil is np.conj)


@pytest.mark.parametrize("spoil", [np.conj, np.negative])
@pytest.mark.parametrize("sensor", [None, 1])
def test_a_repeat_with_phases_of_the_other_sign_is_found(spoil: np.ufunc, sensor: int | None) -> None:
    made = campaign()
    assert not list(find_conjugate_repeats(made))
    table = made.measurement
    rows = (table.repeat == 2) & ((table.sensor == sensor) | (sensor is None))
    (result,) = find_conjugate_repeats(with_values(made, np.where(rows, spoil(table.value), table.value)))
    assert result.where.startswith('test "stepped", repeat 2, ')
    assert ('"tip"' in result.where) == (sensor is None)
    assert ("imaginary" in result.sentence) == (spoil is np.conj)


def test_a_sensor_that_one_of_two_tests_lacks_is_suspected() -> None:
    made = campaign()
    table = made.measurement
    again = replace(table, test=np.ones_like(table.test)).where(table.sensor != 1)
    both = Measurement(
        **{name: np.concatenate([getattr(table, name), getattr(again, name)]) for name in table.__dataclass_fields__}
    )
    two = replace(made, tests=(*made.tests, Test(name="again")), measurement=both)
    assert 'test "again": it has no rows of sensor "slot", which "stepped" has: were they left out?' in sentences(two)
    # Without its contacts a structure has no contact forces.
    force = replace(made.sensors[1], quantity="contact force", line="left", component="normal")
    free = replace(
        two,
        sensors=(made.sensors[0], force, made.sensors[2]),
        tests=(*made.tests, Test(name="again", configuration="free")),
    )
    assert "no rows of sensor" not in sentences(free)


def test_a_repeat_that_is_missing_between_others_is_suspected() -> None:
    made = campaign()
    left = made.measurement.where(made.measurement.repeat != 2)
    result = sentences(replace(made, measurement=left))
    assert 'test "stepped": it has the repeats 1 to 3 but not 2: was a file left out?' in result


@pytest.mark.parametrize(("factors", "listed"), [((1.0, 3.0, 10.0), "1 : 3 : 10"), ((1.0, 1.0, 1.6), "1 : 1 : 1.6")])
def test_repeats_that_are_levels_are_told_and_do_not_drift(factors: tuple[float, ...], listed: str) -> None:
    made = campaign()
    said = sentences(with_values(made, made.measurement.value * np.array(factors)[made.measurement.repeat - 1]))
    assert f"repeats 1, 2, 3 at 3 N differ by factors {listed} over the whole sweep" in said
    assert "drift" not in said


def test_repeats_that_differ_near_a_resonance_alone_are_repeats() -> None:
    made = campaign()
    table = made.measurement
    near = (table.repeat == 2) & (abs(table.frequency - 100) < 4)
    assert "several levels" not in sentences(with_values(made, np.where(near, 3.0, 1.0) * table.value))
