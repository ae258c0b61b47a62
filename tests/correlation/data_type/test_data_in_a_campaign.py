"""Ring-downs, loops, frequency responses and load cells, read by a manifest from their files."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.write_campaign import write_campaign
from correlation.data_type.frequency_response import make_response_panels
from correlation.data_type.linear_response import predict_linear_response
from correlation.data_type.mode import compute_linear_modes
from correlation.data_type.registry import DATA_TYPES
from correlation.data_type.ring_down import compute_ring_down_features, predict_ring_down
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from reduction.load_cell import compute_decoupler_contact

MASS, STIFFNESS, RATIO = 1.3, 5e5, 0.004
SENSOR = """[[sensor]]
name = "tip"
quantity = "displacement"
direction = "z"
place = "tip"
"""
RING_DOWN = """[[ring_down]]
name = "release"
file = "decay.csv"
configuration = "jointed"
sensor = "tip"
[ring_down.columns]
time = "t"
value = { column = "x", unit = "mm" }
"""


def write(folder: Path, manifest: str, **tables: str) -> Path:
    (folder / "campaign.toml").write_text("schema = 1\n" + manifest, encoding="utf-8")
    for name, table in tables.items():
        (folder / f"{name}.csv").write_text(table, encoding="utf-8")
    return folder


def columns(header: str, *values: np.ndarray) -> str:
    return header + "\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in np.column_stack(values)) + "\n"


def test_a_linear_ring_down_has_the_backbone_of_its_model(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    omega = np.sqrt(STIFFNESS / MASS)
    time = np.arange(0, 1.5, 1 / 4000)
    x = 1e-4 * np.exp(-RATIO * omega * time) * np.cos(np.sqrt(1 - RATIO**2) * omega * time)
    (decay,) = read_campaign(write(tmp_path, SENSOR + RING_DOWN, decay=columns("t,x", time, 1e3 * x))).data
    features, predicted = compute_ring_down_features(decay), predict_ring_down(oscillator(), decay)
    assert len(decay.modes) == 1
    # The record is without noise; what is left are the digits that were written.
    assert features.value[0::2] == pytest.approx(omega / (2 * np.pi), rel=1e-4)
    assert features.value[1::2] == pytest.approx(RATIO, rel=0.02)
    assert predicted == pytest.approx(features.value, rel=0.02)


FRF = """[convention]
time = "exp({sign}i omega t)"
amplitude = "peak"
[units]
level = "N"
frequency = "Hz"
[[sensor]]
name = "accelerometer"
quantity = "acceleration"
direction = "z"
place = "tip"
[[test]]
name = "hammer"
configuration = "jointed"
[[frf]]
name = "H"
file = "frf.csv"
test = "hammer"
level = 0.5
[frf.columns]
frequency = "f"
accelerometer = {{ real = "re", imag = "im", unit = "g_n/N" }}
"""


@pytest.mark.parametrize(
    ("modes", "limit"), [("0 Hz", "zero"), ("-5 Hz", "zero"), ("250 Hz", "250 Hz"), ("4 kHz", "250 Hz")]
)
def test_modes_are_between_zero_and_half_the_sampling_rate(tmp_path: Path, modes: str, limit: str) -> None:
    time = np.arange(0, 1.5, 1 / 500)
    data = columns("t,x", time, np.exp(-5 * time) * np.cos(400 * time))
    manifest = SENSOR + RING_DOWN.replace("[ring_down.columns]", f'modes = ["{modes}"]\n[ring_down.columns]')
    with pytest.raises(CampaignError, match=rf"ring_down\[1\]\.modes.*{modes}.*{limit}"):
        read_campaign(write(tmp_path, manifest, decay=data))


def test_an_exponential_window_is_taken_off_the_damping(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    frequency, constant = np.linspace(80, 120, 401), 0.4
    # Force and response times e^(-t/T): the transform is that of the structure at s + 1/T.
    s = 2j * np.pi * frequency + 1 / constant
    response = s**2 / (STIFFNESS + MASS * s**2 + s * 2 * RATIO * np.sqrt(STIFFNESS * MASS))
    written = response / 9.80665
    windowed = FRF.format(sign="+").replace(
        'test = "hammer"\nlevel = 0.5', 'configuration = "jointed"\nwindow = "none"\nexponential_window = "0.4 s"'
    )
    windowed = windowed.replace('[[test]]\nname = "hammer"\nconfiguration = "jointed"\n', "")
    table = columns("f,re,im", frequency, written.real, written.imag)
    (frf,) = read_campaign(write(tmp_path, windowed, frf=table)).data
    # Numbers were written with nine digits; the window alone would add 1/(T omega) = 0.4 %.
    assert [mode.damping for mode in frf.modes] == pytest.approx([RATIO], rel=1e-4)
    assert predict_linear_response(oscillator(), frf)[0] == pytest.approx(response, rel=1e-6)


def test_a_window_that_leaves_no_damping_gives_no_mode(tmp_path: Path) -> None:
    frequency = np.linspace(80, 120, 401)
    s = 2j * np.pi * frequency + 2.5
    response = s**2 / (STIFFNESS + MASS * s**2 + s * 2 * RATIO * np.sqrt(STIFFNESS * MASS))
    stated = FRF.format(sign="+").replace(
        'test = "hammer"\nlevel = 0.5', 'configuration = "jointed"\nexponential_window = "20 ms"'
    )
    stated = stated.replace('[[test]]\nname = "hammer"\nconfiguration = "jointed"\n', "")
    (frf,) = read_campaign(
        write(tmp_path, stated, frf=columns("f,re,im", frequency, response.real, response.imag))
    ).data
    assert frf.modes == ()
    assert any("leaves no damping" in item for item in frf.suspicions)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ('exponential_window = "0.4 s"\nlevel = 0.5', r"frf\[1\]\.level.*decays"),
        ('exponential_window = "0 s"', "1/e"),
        ('exponential_window = "3 Hz"', "exponential_window.*Hz"),
        ('window = "hann"', 'did you mean "Hann"'),
    ],
)
def test_a_window_that_cannot_be_is_refused(tmp_path: Path, keys: str, sentence: str) -> None:
    frequency = np.linspace(80, 120, 41)
    table = columns("f,re,im", frequency, np.cos(frequency), np.sin(frequency))
    with pytest.raises(CampaignError, match=sentence):
        read_campaign(write(tmp_path, FRF.format(sign="+").replace("level = 0.5", keys), frf=table))


@pytest.mark.parametrize("sign", ["+", "-"])
def test_frequency_responses_count_as_steady_states_of_their_level(
    tmp_path: Path, oscillator: Callable[..., Model], sign: str
) -> None:
    frequency = np.linspace(80, 120, 401)
    omega = 2 * np.pi * frequency
    damping = 2 * RATIO * np.sqrt(STIFFNESS * MASS)
    response = -(omega**2) / (STIFFNESS - MASS * omega**2 + 1j * omega * damping)
    written = (response if sign == "+" else response.conj()) / 9.80665
    folder = write(tmp_path, FRF.format(sign=sign), frf=columns("f,re,im", frequency, written.real, written.imag))
    campaign = read_campaign(folder)
    (frf,) = campaign.data
    assert frf.value[0] == pytest.approx(response, rel=1e-6)
    assert predict_linear_response(oscillator(), frf)[0] == pytest.approx(response, rel=1e-6)
    table = campaign.measurement
    assert 20 <= len(table) <= 60
    at = np.searchsorted(frequency, table.frequency)
    assert table.value == pytest.approx(0.5 * response[at], rel=1e-6)
    # States are where the response changes: most of them in the ten hertz around the resonance.
    assert (np.abs(table.frequency - np.sqrt(STIFFNESS / MASS) / (2 * np.pi)) < 5).mean() > 0.6


def test_the_linear_response_on_a_shaken_base_is_absolute(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    """An accelerometer reads the base as well, a relative sensor does not: transmissibility of one mass."""
    frequency = np.linspace(80, 120, 41)
    omega, damping = 2 * np.pi * frequency, 2 * RATIO * np.sqrt(STIFFNESS * MASS)
    push = STIFFNESS + 1j * omega * damping
    transmissibility = push / (push - MASS * omega**2)
    manifest = FRF.format(sign="+").replace('level = "N"', 'level = "m/s^2"').replace("g_n/N", "m/s^2/(m/s^2)")
    manifest = manifest.replace("[units]", '[drive]\nquantity = "base acceleration"\n[units]')
    table = columns("f,re,im", frequency, transmissibility.real, transmissibility.imag)
    campaign = read_campaign(write(tmp_path, manifest, frf=table))
    (frf,) = campaign.data
    still = oscillator()
    shaken = replace(still.with_system(harmonic_force=np.array([[0.0], [-MASS]])), base_acceleration=np.ones(1))
    assert predict_linear_response(shaken, frf)[0] == pytest.approx(transmissibility, rel=1e-9)
    relative = predict_linear_response(shaken.with_sensor("accelerometer", relative=True), frf)[0]
    assert relative == pytest.approx(transmissibility - 1, rel=1e-9)
    (panel,) = make_response_panels(shaken, frf)
    assert panel.y_label == "|H| [m/s^2 per m/s^2]"
    with pytest.raises(CampaignError, match="the case gives its velocity or displacement"):
        with_sensors(replace(shaken, level_power=2), campaign)


def test_a_loss_factor_damps_the_predicted_response(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    """1 / (k (1 + i eta) - m omega^2), and a damping ratio of eta / 2 at the resonance."""
    frequency, eta = np.linspace(80, 120, 41), 0.02
    manifest = FRF.format(sign="+")
    table = columns("f,re,im", frequency, np.cos(frequency), np.sin(frequency))
    (frf,) = read_campaign(write(tmp_path, manifest, frf=table)).data
    still = oscillator()
    model = still.with_system(damping=0 * still.system.damping, structural_damping=eta * still.system.stiffness)
    omega = 2 * np.pi * frequency
    sensor = model.sensors[0]
    expected = sensor.gain * -(omega**2) / ((1 + 1j * eta) * STIFFNESS - MASS * omega**2)
    assert predict_linear_response(model, frf)[0] == pytest.approx(expected, rel=1e-9)
    assert compute_linear_modes(model, "jointed")[1][0] == pytest.approx(eta / 2)


def test_the_response_of_a_rotation_is_in_radians(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    frequency = np.linspace(80, 120, 41)
    manifest = FRF.format(sign="+").replace('direction = "z"', 'direction = "rz"').replace("g_n/N", "rad/s^2/N")
    table = columns("f,re,im", frequency, np.cos(frequency), np.sin(frequency))
    (frf,) = read_campaign(write(tmp_path, manifest, frf=table)).data
    (panel,) = make_response_panels(oscillator(), frf)
    assert panel.y_label == "|H| [rad/s^2 per N]"


@pytest.mark.parametrize("lacking", ["value", "coherence"])
def test_a_missing_value_of_one_sensor_leaves_the_others_theirs(
    tmp_path: Path, oscillator: Callable[..., Model], lacking: str
) -> None:
    frequency = np.linspace(80, 120, 401)
    omega = 2 * np.pi * frequency
    response = -(omega**2) / (STIFFNESS - MASS * omega**2 + 2j * omega * RATIO * np.sqrt(STIFFNESS * MASS)) / 9.80665
    gap = np.where((frequency > 97) & (frequency < 98), np.nan, 1.0)  # 9 lines on the flank, where states are
    other, coherence = (gap * response, np.ones(401)) if lacking == "value" else (response, gap)
    data = columns("f,re,im,re2,im2,c", frequency, response.real, response.imag, other.real, other.imag, coherence)
    manifest = FRF.format(sign="+").replace("level = 0.5", 'level = 0.5\nmissing = "skip"')
    second = manifest[manifest.index("[[sensor]]") : manifest.index("[[test]]")].replace("accelerometer", "second")
    manifest += 'second = { real = "re2", imag = "im2", unit = "g_n/N" }\n[frf.coherence]\nsecond = "c"\n' + second
    campaign = read_campaign(write(tmp_path, manifest, frf=data))
    (frf,) = campaign.data
    assert np.isnan(frf.value).sum(axis=1).tolist() == [0, 9]
    assert [mode.frequency for mode in frf.modes] == pytest.approx([np.sqrt(STIFFNESS / MASS) / (2 * np.pi)])
    assert any('"second" has no number at 9 of 401 lines' in str(item) and "392" in str(item)
               for item in campaign.suspicions)  # fmt: skip
    table = campaign.measurement
    whole, rest = (set(table.frequency[table.sensor == number].tolist()) for number in (0, 1))
    assert rest < whole
    assert all(97 < lost < 98 for lost in whole - rest)
    model = oscillator()
    model = replace(model, sensors=(*model.sensors, replace(model.sensors[1], name="second")))
    panels = make_response_panels(model, frf)
    assert [len(panel.measured[0][0]) for panel in panels] == [401, 392]


def test_spectra_of_response_and_force_make_a_frequency_response(tmp_path: Path) -> None:
    frequency = np.linspace(80, 120, 41)
    response, force = np.exp(1j * frequency / 7), 3 - 4j * frequency / 100
    own = 'force = { real = "Fr", imag = "Fi", unit = "kN" }\n'
    moved = 1e3 * force * response / 9.80665
    data = columns("f,re,im,Fr,Fi", frequency, moved.real, moved.imag, force.real, force.imag)
    (frf,) = read_campaign(write(tmp_path, FRF.format(sign="+").replace("g_n/N", "g_n") + own, frf=data)).data
    # Ten digits are written.
    assert frf.value[0] == pytest.approx(response, rel=1e-6)


def test_a_frequency_response_without_its_force_asks_for_it(tmp_path: Path) -> None:
    frequency = np.linspace(80, 120, 41)
    data = columns("f,re,im", frequency, np.cos(frequency), np.sin(frequency))
    with pytest.raises(CampaignError, match=r"frf\[1\].columns.accelerometer.*the force is missing: add force = "):
        read_campaign(write(tmp_path, FRF.format(sign="+").replace("g_n/N", "mm/s^2"), frf=data))


def test_a_contact_force_is_no_frequency_response(tmp_path: Path) -> None:
    frequency = np.linspace(80, 120, 41)
    data = columns("f,re,im", frequency, np.cos(frequency), np.sin(frequency))
    contact = '[[sensor]]\nname = "left_T"\nquantity = "contact force"\nline = "left"\ncomponent = "tangential"\n'
    manifest = FRF.format(sign="+") + 'left_T = { real = "re", imag = "im", unit = "N/N" }\n' + contact
    with pytest.raises(CampaignError, match=r"frf\[1\].columns.left_T.*contact force"):
        read_campaign(write(tmp_path, manifest, frf=data))


@pytest.mark.parametrize(("largest", "fits"), [(98.0, False), (-0.2, False), (1.0005, True)])
def test_a_coherence_is_between_0_and_1(tmp_path: Path, largest: float, fits: bool) -> None:
    frequency = np.linspace(80, 120, 41)
    coherence = np.where(frequency == 100, largest, 0.9)
    data = columns("f,re,im,c", frequency, np.cos(frequency), np.sin(frequency), coherence)
    manifest = FRF.format(sign="+") + '[frf.coherence]\naccelerometer = "c"\n'
    if fits:
        assert read_campaign(write(tmp_path, manifest, frf=data)).data[0].coherence.max() == 1.0
        return
    with pytest.raises(CampaignError, match=rf"frf\[1\].coherence.accelerometer: is {largest:g} at row 21"):
        read_campaign(write(tmp_path, manifest, frf=data))


LOOP = """[[loop]]
name = "bench"
file = "loop.csv"
place = "tip"
frequency = "1 Hz"
[loop.columns]
displacement = { column = "x", unit = "m" }
force = { column = "F", unit = "N" }
"""


def test_what_looks_wrong_in_a_loop_is_a_suspicion_of_the_campaign(tmp_path: Path) -> None:
    turn = np.linspace(0, 8 * np.pi, 2001)
    data = columns("x,F", 1e-3 * np.cos(turn), np.cos(turn - 0.5))  # the force lags: the loop gives energy
    campaign = read_campaign(write(tmp_path, LOOP, loop=data))
    assert any("bench: the loops run in the opposite direction" in str(item) for item in campaign.suspicions)


CELLS = """[convention]
time = "exp(+i omega t)"
amplitude = "peak"
[units]
level = "N"
frequency = "Hz"
[[sensor]]
name = "R3"
quantity = "load cell"
[[sensor]]
name = "R4"
quantity = "load cell"
[[sensor]]
name = "left_T"
quantity = "contact force"
line = "left"
component = "tangential"
[[sensor]]
name = "left_N"
quantity = "contact force"
line = "left"
component = "normal"
[[load_cells]]
cells = ["R3", "R4"]
tangential = "left_T"
normal = "left_N"
taper = "8.53 deg"
arm = "45 deg"
[[test]]
name = "t"
configuration = "jointed"
[[run]]
test = "t"
file = "cells.csv"
level = 1.0
[run.columns]
frequency = "f"
R3 = { real = "a", imag = "b", unit = "N" }
R4 = { real = "c", imag = "d", unit = "N" }
"""


def test_load_cells_become_the_forces_of_equation_1(tmp_path: Path) -> None:
    campaign = read_campaign(write(tmp_path, CELLS, cells="f,a,b,c,d\n10,3,1,1,-1\n11,2,0,1,0.5\n"))
    assert [sensor.name for sensor in campaign.sensors] == ["left_T", "left_N"]
    table = campaign.measurement
    r3, r4 = np.array([3 + 1j, 2]), np.array([1 - 1j, 1 + 0.5j])
    expected = compute_decoupler_contact(r3, r4, np.radians(8.53), np.radians(45))
    assert table.value[table.sensor == 0] == pytest.approx(expected.tangential)
    assert table.value[table.sensor == 1] == pytest.approx(expected.normal)


def test_contact_forces_have_the_stated_errors_of_their_cells(tmp_path: Path) -> None:
    stated = CELLS.replace('name = "R3"\n', 'name = "R3"\nnoise = ["1 %", "0.3 N"]\nuncertainty = "2 %"\n')
    stated = stated.replace('name = "R4"\n', 'name = "R4"\nnoise = "0.3 N"\n')
    forces = read_campaign(write(tmp_path, stated, cells="f,a,b,c,d\n10,3,1,1,-1\n11,2,0,1,0.5\n")).sensors
    # At 45 degrees the rotation keeps the noise of equal cells.
    for force in forces:
        assert force.noise == pytest.approx((0.01, 0.3))
        assert force.uncertainty == 0.02


def test_a_load_cell_of_the_model_is_compared_itself(tmp_path: Path) -> None:
    alone = CELLS.replace('[[load_cells]]\ncells = ["R3", "R4"]\ntangential = "left_T"\nnormal = "left_N"\n', "")
    alone = alone.replace('taper = "8.53 deg"\narm = "45 deg"\n', "")
    for name in ("left_T", "left_N"):
        component = "tangential" if name == "left_T" else "normal"
        alone = alone.replace(
            f'[[sensor]]\nname = "{name}"\nquantity = "contact force"\nline = "left"\ncomponent = "{component}"\n', ""
        )
    data = "f,a,b,c,d\n10,3,1,1,-1\n11,2,0,1,0.5\n"
    with pytest.raises(CampaignError, match=r'"R3" is a load cell.*\[\[load_cells\]\]'):
        read_campaign(write(tmp_path, alone, cells=data))
    named = alone.replace('quantity = "load cell"\n', 'quantity = "load cell"\ncell = "R9"\n')
    campaign = read_campaign(write(tmp_path, named, cells=data))
    assert [sensor.cell for sensor in campaign.sensors] == ["R9", "R9"]
    write_campaign(campaign, tmp_path / "again")
    assert [sensor.cell for sensor in read_campaign(tmp_path / "again").sensors] == ["R9", "R9"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('cells = ["R3", "R4"]', 'cells = ["R3"]', ["load_cells[1].cells", "two"]),
        ('cells = ["R3", "R4"]', 'cells = ["R3", "left_T"]', ["load_cells[1].cells", '"left_T"']),
        ('tangential = "left_T"', 'tangential = "left_N"', ["load_cells[1].tangential"]),
        ('taper = "8.53 deg"', 'taper = "8.53 mm"', ["load_cells[1].taper", "mm"]),
        ('name = "R4"\n', 'name = "R4"\nphase = false\n', ["load_cells[1].cells", '"R4"', "phase = false"]),
        ('name = "R3"\n', 'name = "R3"\ncalibrated = false\n', ["load_cells[1].cells", '"R3"', "calibrated = false"]),
        ('name = "left_T"\n', 'name = "left_T"\nphase = false\n', ["load_cells[1].tangential", "phase = false"]),
        ('side = "blade"\n', "", []),
    ],
)
def test_a_mistake_in_load_cells_names_its_key(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    folder = write(tmp_path, CELLS.replace(old, new), cells="f,a,b,c,d\n10,3,1,1,-1\n11,2,0,1,0.5\n")
    if not words:
        assert read_campaign(folder).sensors
        return
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder)
    for word in words:
        assert word in str(caught.value)


def test_a_load_cell_without_a_pair_is_refused(tmp_path: Path) -> None:
    manifest = CELLS + 'R5 = { real = "a", imag = "d", unit = "N" }\n[[sensor]]\nname = "R5"\nquantity = "load cell"\n'
    folder = write(tmp_path, manifest, cells="f,a,b,c,d\n10,3,1,1,-1\n11,2,0,1,0.5\n")
    with pytest.raises(CampaignError, match=r'sensor "R5".*2 rows, but no \[\[load_cells\]\] names it'):
        read_campaign(folder)


def test_every_type_says_what_it_holds() -> None:
    assert {kind.table for kind in DATA_TYPES} >= {"frf", "loop", "mode", "ring_down"}
    assert all(kind.holds for kind in DATA_TYPES)


def test_modes_are_read_from_noisy_responses(tmp_path: Path, oscillator: Callable[..., Model]) -> None:
    frequency = np.linspace(80, 120, 801)
    omega, random = 2 * np.pi * frequency, np.random.default_rng(3)
    response = -(omega**2) / (STIFFNESS - MASS * omega**2 + 2j * omega * RATIO * np.sqrt(STIFFNESS * MASS))
    noise = 0.01 * np.abs(response).max() / np.sqrt(2) * (random.standard_normal((2, 801)).T @ [1, 1j])
    written = (response + noise) / 9.80665
    folder = write(tmp_path, FRF.format(sign="+"), frf=columns("f,re,im", frequency, written.real, written.imag))
    (frf,) = read_campaign(folder).data
    kind = DATA_TYPES[frf.type]
    features, predicted = kind.features(frf), kind.predict(oscillator(), frf)
    assert features.label == ("frequency of mode 1", "damping ratio of mode 1")
    # One percent of noise on 800 lines: within the deviations that are stated.
    assert np.abs(features.value - predicted).max() < 4 * features.deviation.max()
    assert (np.abs(features.value - predicted) < 4 * features.deviation).all()
    assert kind.panels is not None
    (panel,) = kind.panels(oscillator(), frf)
    assert len(panel.measured) == len(panel.predicted) == 1


@pytest.mark.parametrize("seed", [0, 1])
def test_noise_of_an_accelerometer_is_even_in_acceleration(tmp_path: Path, seed: int) -> None:
    frequency = np.arange(4.0, 400.0, 0.25)
    omega, random = 2 * np.pi * frequency, np.random.default_rng(seed)
    response = -(omega**2) / (STIFFNESS - MASS * omega**2 + 2j * omega * RATIO * np.sqrt(STIFFNESS * MASS))
    size = 0.01 * np.abs(response).max() / np.sqrt(2)
    written = (response + size * (random.standard_normal((2, len(omega))).T @ [1, 1j])) / 9.80665
    folder = write(tmp_path, FRF.format(sign="+"), frf=columns("f,re,im", frequency, written.real, written.imag))
    (frf,) = read_campaign(folder).data
    # As a receptance its noise at 4 Hz would be 600 times that at the resonance, which then is known to 0.5 %.
    (mode,) = frf.modes
    natural = np.sqrt(STIFFNESS / MASS) / (2 * np.pi)
    assert abs(mode.frequency - natural) < 1e-4 * natural
    # 2e-4 is the least that a test is given, noise adds 3e-5.
    assert mode.frequency_deviation < 2.1e-4 * natural


BENCH_LOOP = """[[loop]]
name = "bench"
file = "loop.csv"
frequency = "1 Hz"
place = "tip"
{zero}
[loop.columns]
displacement = {{ column = "x", unit = "mm" }}
force = {{ column = "f", unit = "N" }}
"""


@pytest.mark.parametrize(("zero", "middle"), [("", 0.0), ('zero = "as measured"', 31e-3)])
def test_the_offset_of_a_displacement_sensor_is_no_force_of_the_model(
    tmp_path: Path, oscillator: Callable[..., Model], zero: str, middle: float
) -> None:
    x = 1e-3 * np.cos(2 * np.pi * np.arange(3000) / 500)
    table = columns("x,f", 1e3 * (x + 31e-3), STIFFNESS * x)
    (loop,) = read_campaign(write(tmp_path, BENCH_LOOP.format(zero=zero), loop=table)).data
    kind = DATA_TYPES[loop.type]
    predicted, features = kind.predict(oscillator(), loop), kind.features(loop)
    assert predicted[2] == pytest.approx(STIFFNESS * middle, abs=1e-3 * STIFFNESS * 1e-3)
    assert kind.coverage is not None
    assert ("31 mm" in kind.coverage(loop)) == (not middle)
    # The force of a sensor that was right would be as uncertain; one that is as measured to 1 % of the loop's.
    assert features.deviation[2] == pytest.approx(STIFFNESS * (1e-5 if middle else 31e-3), rel=0.01)


def test_periods_that_are_used_and_left_out_are_named(tmp_path: Path) -> None:
    amplitude = np.repeat([1.0, 1.0, 1.0, 3.0, 2.0, 2.0, 4.0], 500)
    x = 1e-3 * amplitude * np.sin(2 * np.pi * np.arange(len(amplitude)) / 500)
    table = columns("x,f", 1e3 * x, STIFFNESS * x)
    (loop,) = read_campaign(write(tmp_path, BENCH_LOOP.format(zero=""), loop=table)).data
    coverage = DATA_TYPES[loop.type].coverage
    assert coverage is not None
    assert coverage(loop).startswith("3 of 6 periods are used, of 1 mm (2), 2 mm; 3 of 1.5 to 2.75 mm")
