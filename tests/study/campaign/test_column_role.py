"""Roles of columns from units, names and values; kinds of histories from their envelopes."""

import io

import numpy as np
import pytest

from correlation.file.column import Column
from study.campaign.column_role import ComplexPart, Role, name_words, recognise_column
from study.campaign.phase_convention import has_opposite_sign, judge_phase
from study.campaign.question import Question, Terminal
from study.campaign.repeat import is_settling
from study.campaign.time_history import find_uniform_rate, judge_history

RAMP = np.linspace(1.0, 5.0, 20)


@pytest.mark.parametrize(
    ("name", "unit", "role", "quantity", "of_unit"),
    [
        ("frequency", "", Role.FREQUENCY, "", "Hz"),
        ("time", "", Role.TIME, "", "s"),
        ("f", "Hz", Role.FREQUENCY, "frequency", "Hz"),
        ("drive_Hz", "", Role.FREQUENCY, "frequency", "Hz"),
        ("omega", "", Role.FREQUENCY, "", "rad/s"),
        ("Zeit", "s", Role.TIME, "time", "s"),
        ("time_ms", "", Role.TIME, "time", "ms"),
        ("hammer", "", Role.FORCE, "force", "N"),
        ("Kraft", "", Role.FORCE, "force", "N"),
        ("Kraft", "V", Role.FORCE, "voltage", "V"),
        ("drive", "", Role.FORCE, "force", ""),
        ("mic_2", "V", Role.FOREIGN, "", "V"),
        ("channel 4", "Pa", Role.FOREIGN, "", "Pa"),
        ("channel 4", "Pa/N", Role.FOREIGN, "", "Pa/N"),
        ("channel 4", "degC", Role.FOREIGN, "", "degC"),
        ("mic holder", "m/s^2", Role.RESPONSE, "acceleration", "m/s^2"),
        ("channel 3", "N", Role.FORCE, "force", "N"),
        ("band_force_1_N", "", Role.FORCE, "force", "N"),
        ("acc tip", "", Role.RESPONSE, "acceleration", ""),
        ("channel 1", "g_n", Role.RESPONSE, "acceleration", "g_n"),
        ("tipVelocity_mm_s", "", Role.RESPONSE, "velocity", "mm/s"),
        ("v01_m_s", "", Role.RESPONSE, "velocity", "m/s"),
        ("V1", "", Role.RESPONSE, "voltage", "V"),
        ("tip", "(m/s^2)/N", Role.RESPONSE, "acceleration", "(m/s^2)/N"),
        ("Spannung", "V", Role.FORCE, "voltage", "V"),
        ("generator voltage", "mV", Role.FORCE, "voltage", "mV"),
        ("voltage acc", "V", Role.RESPONSE, "voltage", "V"),
        ("level", "", Role.LEVEL, "", ""),
        ("repeat", "", Role.REPEAT, "", ""),
        ("coherence tip", "", Role.COHERENCE, "", ""),
        ("Kohärenz", "", Role.COHERENCE, "", ""),
        ("vel_tip_mms", "", Role.RESPONSE, "velocity", "mm/s"),
        ("acc_ms2(:,2)", "", Role.RESPONSE, "acceleration", "m/s^2"),
        ("tip", "1/kg", Role.RESPONSE, "acceleration", "1/kg"),
        ("tip", "m/(N*s)", Role.RESPONSE, "velocity", "m/(N*s)"),
        ("remark", "", Role.OTHER, "", ""),
    ],
)
def test_a_column_is_recognised_by_its_unit_and_name(
    name: str, unit: str, role: Role, quantity: str, of_unit: str
) -> None:
    guess = recognise_column(Column(name=name, values=RAMP, unit=unit), name)
    assert (guess.role, guess.quantity, guess.unit) == (role, quantity, of_unit)
    assert guess.evidence


@pytest.mark.parametrize(("largest", "unit"), [(3.1, "rad"), (6.2, "rad"), (175.0, "deg"), (30.0, "deg")])
def test_the_range_of_a_phase_tells_degrees_from_radians(largest: float, unit: str) -> None:
    guess = recognise_column(Column(name="phase", values=np.linspace(-largest, largest, 9)), "phase")
    assert (guess.role, guess.unit) == (Role.PHASE, unit)
    assert f"{largest:.4g}" in guess.evidence


def test_parts_of_complex_numbers_are_told_by_their_names() -> None:
    german = (
        ("Weg Realteil", ComplexPart.REAL),
        ("Weg Imaginärteil", ComplexPart.IMAGINARY),
        ("Betrag", ComplexPart.AMPLITUDE),
    )
    for name, part in (
        ("tip re", ComplexPart.REAL),
        ("tip_imag", ComplexPart.IMAGINARY),
        ("Amplitude", ComplexPart.AMPLITUDE),
        *german,
    ):
        assert recognise_column(Column(name=name, values=RAMP), name).part is part
    assert recognise_column(Column(name="tip", values=RAMP + 1j), "tip").part is ComplexPart.VALUE


def test_accents_stay_in_the_words_of_a_name() -> None:
    assert name_words("Déplacement_pointe [mm]") == name_words("De\u0301placement pointe") == ["déplacement", "pointe"]


TIME = np.arange(4000) / 1000
TONE = np.sin(2 * np.pi * 50 * TIME)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.exp(-2 * TIME) * TONE, "decay"),
        (TONE + 0.2 * np.sin(2 * np.pi * 150 * TIME), "steady state"),
        (np.where(np.abs(TIME - 0.1) < 0.002, 100.0, 0.0), "pulse"),
        (np.random.default_rng(1).normal(size=4000), "broadband"),
        ((0.2 + TIME) * TONE, "broadband"),
    ],
)
def test_a_history_is_judged_by_its_envelope_and_spectrum(values: np.ndarray, kind: str) -> None:
    judged = judge_history(values)
    assert judged.kind == kind
    if kind == "steady state":
        assert judged.frequency == pytest.approx(0.05)  # 50 Hz at 1000 samples a second


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [3, 10, 19, 21])
def test_a_history_of_few_samples_is_judged_without_a_warning(count: int) -> None:
    assert judge_history(np.sin(np.arange(float(count)))).kind


def test_a_rate_needs_a_uniform_step() -> None:
    assert find_uniform_rate(np.round(TIME, 3)) == pytest.approx(1000.0, rel=1e-12)
    assert find_uniform_rate(TIME**1.1) is None
    assert find_uniform_rate(TIME[::-1]) is None


def oscillator(sign: int, power: int) -> np.ndarray:
    """Response of a mass on a spring times (i omega)^power, for e^{sign i omega t}."""
    omega = np.linspace(90, 110, 60)
    x = (1j * omega) ** power / (100.0**2 - omega**2 + 2j * omega)
    return x if sign > 0 else x.conj()


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("quantity", "power"), [("displacement", 0), ("velocity", 1), ("acceleration", 2)])
def test_phases_tell_the_sign_of_time_and_of_the_sensor(sign: int, quantity: str, power: int) -> None:
    for turned in (1, -1):
        evidence = judge_phase(np.linspace(90, 110, 60), turned * oscillator(sign, power))
        assert evidence is not None
        assert evidence.time_sign == sign
        assert has_opposite_sign(evidence, quantity, sign) == (turned < 0)


def test_a_flat_phase_tells_nothing() -> None:
    evidence = judge_phase(np.arange(20.0), np.ones(20, dtype=complex))
    assert evidence is not None
    assert evidence.time_sign == 0
    assert not has_opposite_sign(evidence, "displacement", 1)


def test_readings_that_settle_go_one_way_in_smaller_steps() -> None:
    frequency = np.repeat(np.arange(10.0), 4)
    settling = np.tile(1 + 0.5 ** np.arange(4), 10)
    assert "10 of 10" in is_settling(frequency, [settling])
    assert not is_settling(frequency, [np.random.default_rng(3).normal(10, 0.1, 40)])
    assert not is_settling(np.arange(40.0), [settling])


def test_a_person_is_asked_once_and_an_empty_line_takes_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("\nrms\nweird\npeak to\n"))
    terminal = Terminal()
    place = Question(text="Where?", default="tip", why="it is not said")
    meaning = Question(text="What?", default="peak", why="it is not said", choices=("peak", "rms", "peak to peak"))
    other = Question(text="And here?", default="rms", why="it is not said", choices=meaning.choices)
    assert terminal.ask(place).value == "tip"
    assert terminal.ask(meaning).value == "rms"
    assert terminal.ask(meaning).value == "rms"
    assert terminal.ask(other).value == "peak to peak"
    assert terminal.ask(place).assumed == ""
    at_the_end = Question(text="More?", default="no", why="nobody answers")
    assert terminal.ask(at_the_end).assumed == "nobody answers"
