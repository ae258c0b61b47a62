"""``stickslip estimate`` on a chain with a rubbing line whose measured stiffness, friction and damping are known."""

import json
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from study.case.setup import read_case
from study.cli import main
from study.diagnose.add import undo
from study.estimate.resonance import MeasuredResonance, estimate_stiffness, find_partners, find_resonances

STIFFNESS, DAMPING = 4e5, 0.004
KT, MU, PRELOAD = 2e5, 0.4, 20.0
#: What the "specimen" has over the case.
MORE_KT, MORE_MU, MORE_DAMPING = 1.4, 1.25, 1.5
CASE = f"""schema = 2
title = "A chain that rubs"  # stays
[structure]
kind = "plain"
file = "chain.npz"
[structure.damping]
ratio = {DAMPING}
[[structure.dof]]
direction = "x"
[[structure.dof]]
direction = "x"
[[structure.dof]]
direction = "z"
[[line]]
name = "seam"
tangent = [{{ dof = 1 }}]
normal = [{{ dof = 2 }}]
normal_stiffness = "1 N/um"
tangential_stiffness = "{KT} N/m"
friction_coefficient = {MU}
preload = "{PRELOAD} N"
[[place]]
name = "end"
dof = 1
[[load]]
dof = 0
amplitude = "1 N"
[[sensor]]
name = "end"
dof = 1
[accepted]
"""
MANIFEST = """schema = 1
title = "First tests"
[[sensor]]
name = "end"
quantity = "displacement"
direction = "x"
place = "end"
[[loop]]
name = "seam at 10 N"
file = "loop.csv"
line = "seam"
sensor = "end"
level = "10 N"
frequency = "10 Hz"
[loop.columns]
displacement = { column = "x", unit = "m" }
force = { column = "T", unit = "N" }
"""
MODE = """[[mode]]
name = "{name}"
configuration = "{name}"
frequency = "{frequency} Hz"
frequency_deviation = "0.01 Hz"
damping = "{damping} %"
damping_deviation = "0.001 %"
"""
SINE = """[convention]
time = "exp(+i omega t)"
amplitude = "peak"
[units]
level = "N"
frequency = "Hz"
[[test]]
name = "sine"
configuration = "jointed"
[[run]]
test = "sine"
file = "sine.csv"
level = 1
[run.columns]
frequency = "f"
end = { amplitude = "x", phase = "angle", unit = "m", phase_unit = "rad" }
"""


def chain(kt: complex) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of the specimen with a spring of the wall along x."""
    stiffness = STIFFNESS * np.array([[2.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 100.0]])
    stiffness = stiffness + kt * np.diag([0.0, 1.0, 0.0])
    return np.eye(3), stiffness


def first_frequency(kt: float) -> float:
    return float(np.sqrt(np.linalg.eigvalsh(chain(kt)[1]).min()) / (2 * np.pi))


def rub(place: np.ndarray, stiffness: float, limit: float) -> np.ndarray:
    slider, forces = 0.0, np.zeros(len(place))
    for i, x in enumerate(place):
        forces[i] = np.clip(stiffness * (x - slider), -limit, limit)
        slider = x - forces[i] / stiffness
    return forces


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    mass, stiffness = chain(0.0)
    np.savez(tmp_path / "chain.npz", M=mass, K=stiffness)
    (tmp_path / "chain.toml").write_text(CASE, encoding="utf-8")
    (tmp_path / "tests").mkdir()
    random = np.random.default_rng(0)
    x = 2e-4 * np.cos(2 * np.pi * np.arange(6 * 400) / 400)
    force = rub(x, MORE_KT * KT, MORE_MU * MU * PRELOAD) + 0.05 * random.standard_normal(len(x))
    rows = "\n".join(f"{a:.9g},{b:.9g}" for a, b in zip(x, force, strict=True))
    (tmp_path / "tests" / "loop.csv").write_text(f"x,T\n{rows}\n", encoding="utf-8")
    modes = [
        MODE.format(name=name, frequency=f"{first_frequency(kt):.6g}", damping=f"{100 * MORE_DAMPING * DAMPING:.6g}")
        for name, kt in (("jointed", MORE_KT * KT), ("free", 0.0))
    ]
    (tmp_path / "tests" / "campaign.toml").write_text(MANIFEST + "".join(modes), encoding="utf-8")
    return tmp_path


def run(folder: Path, capfdbinary: pytest.CaptureFixture[bytes], *options: str) -> dict[str, object]:
    assert main(["estimate", str(folder / "chain.toml"), str(folder / "tests"), "--json", *options]) == 0
    result: dict[str, object] = json.loads(capfdbinary.readouterr().out)
    return result


def test_factors_on_the_case_are_those_of_the_specimen(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    before = (folder / "chain.toml").read_text(encoding="utf-8")
    result = run(folder, capfdbinary)
    estimates: list[dict[str, object]] = result["estimates"]  # type: ignore[assignment]
    loop = {item["parameter"]: item for item in estimates if "loop" in str(item["source"])}
    # Noise of 0.6 % of the force over 2000 samples; the target is the interval.
    assert loop["kt"]["factor"] == pytest.approx(MORE_KT, rel=0.01)
    assert loop["mu"]["factor"] == pytest.approx(MORE_MU, rel=0.01)
    low, high = loop["kt"]["interval"]  # type: ignore[misc]
    assert low <= MORE_KT * KT <= high
    by_frequency = next(
        item for item in estimates if item["parameter"] == "kt" and "compared with" in str(item["source"])
    )
    assert by_frequency["factor"] == pytest.approx(MORE_KT, rel=0.01)  # interpolated on 40 factors of two decades
    zeta = next(item for item in estimates if item["parameter"] == "zeta" and "jointed" in str(item["source"]))
    assert zeta["factor"] == pytest.approx(MORE_DAMPING, rel=0.01)
    assert any("inclined" in sentence for sentence in loop["kt"]["bias"])  # type: ignore[union-attr]
    assert any("preload" in sentence for sentence in result["missing"])  # type: ignore[union-attr]
    assert (folder / "chain.toml").read_text(encoding="utf-8") == before


def test_write_changes_the_case_and_keeps_its_comments(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    result = run(folder, capfdbinary, "--write")
    assert result["written"]
    text = (folder / "chain.toml").read_text(encoding="utf-8")
    assert "# stays" in text
    assert "[calibrated]" in text
    assert "first estimate from" in text
    again = run(folder, capfdbinary)
    # The case as drawn is what factors refer to: a second run finds the same.
    assert [item["factor"] for item in again["estimates"]] == [item["factor"] for item in result["estimates"]]  # type: ignore[index, union-attr]
    assert again["lines"] == []


def test_undo_takes_written_estimates_back(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    case = folder / "chain.toml"
    before = case.read_bytes()
    run(folder, capfdbinary, "--write")
    assert undo(case).effect == "first estimates"
    assert case.read_bytes() == before


def test_a_value_beyond_what_its_prior_lets_a_fit_reach_is_said(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    assert not any("its prior" in str(item) for item in run(folder, capfdbinary)["warnings"])  # type: ignore[union-attr]
    case = folder / "chain.toml"
    case.write_text(case.read_text(encoding="utf-8").replace("[accepted]", "[accepted]\nkt = 0.01"), encoding="utf-8")
    (said,) = (item for item in run(folder, capfdbinary)["warnings"] if "its prior" in item)  # type: ignore[union-attr]
    assert "limits fits to 1.05" in said
    wide = float(said.split("kt = ")[1].split(" in [accepted]")[0])
    assert 2 * wide == pytest.approx(MORE_KT - 1, rel=0.05)  # two digits


def jenkins(slip: float) -> complex:
    """Complex stiffness over kt of one Jenkins element, at an amplitude over that at which it begins to slip."""
    angle = np.arccos(1 - 2 / slip)
    return complex((angle - np.sin(2 * angle) / 2 + 1j * np.sin(angle) ** 2) / np.pi)


def micro_slip(share: float) -> complex:
    """The same of a contact F = k u - c u^2 whose loops are Masing's, with share = c A / k."""
    phase = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    gone = 1 - np.cos(phase)  # from the reversal at u = A, and again from that at -A
    there = 1 - gone + share * (gone**2 / 2 - 1)
    back = -1 + (1 + np.cos(phase)) - share * ((1 + np.cos(phase)) ** 2 / 2 - 1)
    return complex(2 * np.mean(np.where(phase < np.pi, there, back) * np.exp(-1j * phase)))


@pytest.mark.parametrize(
    "contact", [jenkins(1.02), jenkins(1.3), jenkins(2.0), micro_slip(0.02), micro_slip(0.1), micro_slip(0.3)]
)
def test_the_interval_of_a_frequency_holds_the_stiffness_of_contacts_that_slip(folder: Path, contact: complex) -> None:
    assert contact.imag > 0
    assert contact.real < 1
    mass, stiffness = chain(MORE_KT * KT * contact)
    squared = np.linalg.eigvals(np.linalg.solve(mass, stiffness))
    first = squared[np.argmin(squared.real)]
    stuck = MeasuredResonance(
        free=False, frequency=float(np.sqrt(first.real)) / (2 * np.pi), frequency_deviation=1e-3,
        damping=DAMPING + float(first.imag / (2 * first.real)), damping_deviation=1e-5, source="level 1",
    )  # fmt: skip
    free = MeasuredResonance(
        free=True, frequency=first_frequency(0.0), frequency_deviation=1e-3, damping=DAMPING, damping_deviation=1e-5,
        source="free",
    )  # fmt: skip
    setup = read_case(folder / "chain.toml", read_campaign(folder / "tests")).setup
    (result,) = estimate_stiffness(setup.model, stuck, free, 1.0)
    low, high = result.interval
    assert low <= MORE_KT * KT <= high


def test_a_jointed_resonance_is_laid_beside_the_free_mode_that_it_goes_back_to(folder: Path) -> None:
    model = read_case(folder / "chain.toml", read_campaign(folder / "tests")).setup.model
    mass, stiffness = chain(0.0)
    free = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real) / (2 * np.pi)
    mass, stiffness = chain(KT)
    stuck = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real) / (2 * np.pi)

    def resonance(frequency: float, *, is_free: bool) -> MeasuredResonance:
        return MeasuredResonance(
            free=is_free, frequency=frequency, frequency_deviation=1e-3, damping=DAMPING, damping_deviation=1e-5,
            source="hammer",
        )  # fmt: skip

    measured = [resonance(item, is_free=True) for item in np.sort(free).tolist()]
    # The contact does not change the order of the two modes along the chain.
    for number, frequency in enumerate(np.sort(stuck).tolist()):
        assert find_partners(model, resonance(frequency, is_free=False), measured) == [measured[number]]
    assert find_partners(model, resonance(float(stuck.max()), is_free=False), measured[:1]) == measured[:1]
    assert find_partners(model, resonance(float(stuck.max()), is_free=False), []) == []


def test_damping_that_friction_may_be_part_of_is_an_upper_bound_and_replaces_no_value_within_it(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    manifest = folder / "tests" / "campaign.toml"
    jointed, _ = manifest.read_text(encoding="utf-8").rsplit("[[mode]]", 1)
    manifest.write_text(jointed, encoding="utf-8")  # without the free structure
    result = run(folder, capfdbinary)
    estimates: list[dict[str, object]] = result["estimates"]  # type: ignore[assignment]
    (zeta,) = (item for item in estimates if item["parameter"] == "zeta")
    assert zeta["interval"][0] == 0  # type: ignore[index]
    assert not zeta["chosen"]
    # Against a case with more damping than that the bound speaks.
    case = (folder / "chain.toml").read_text(encoding="utf-8")
    (folder / "chain.toml").write_text(case.replace(f"ratio = {DAMPING}", "ratio = 0.02"), encoding="utf-8")
    estimates = run(folder, capfdbinary)["estimates"]  # type: ignore[assignment]
    (zeta,) = (item for item in estimates if item["parameter"] == "zeta")
    assert zeta["chosen"]


def test_a_loop_whose_force_helps_the_motion_is_a_sentence(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    file = folder / "tests" / "loop.csv"
    head, *rows = file.read_text(encoding="utf-8").splitlines()
    turned = [f"{x},{-float(force)}" for x, force in (row.split(",") for row in rows)]
    file.write_text("\n".join([head, *turned]), encoding="utf-8")
    result = run(folder, capfdbinary)
    assert any("sign = -1" in sentence for sentence in result["warnings"])  # type: ignore[union-attr]
    assert not [item for item in result["estimates"] if "loop" in str(item["source"])]  # type: ignore[union-attr, index]


def test_a_resonance_that_the_model_lacks_hides_no_other(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    """The bench has modes of its own, far below those of the chain."""
    manifest = folder / "tests" / "campaign.toml"
    text = manifest.read_text(encoding="utf-8")
    bench = "".join(
        MODE.format(name=name, frequency=3.0, damping=1.0).replace(f'name = "{name}"', f'name = "bench {name}"', 1)
        for name in ("jointed", "free")
    )
    manifest.write_text(text.replace("[[mode]]", f"{bench}[[mode]]", 1), encoding="utf-8")
    estimates: list[dict[str, object]] = run(folder, capfdbinary)["estimates"]  # type: ignore[assignment]
    result = [item for item in estimates if item["parameter"] == "kt" and "compared with" in str(item["source"])]
    assert [item["factor"] for item in result] == pytest.approx([MORE_KT], rel=0.01)


def test_modes_of_stepped_sines_are_told_apart_whichever_is_higher_in_a_repeat_or_at_a_level(folder: Path) -> None:
    natural, ratio = (100.0, 125.0), 0.01
    lines = np.linspace(90.0, 135.0, 91)
    manifest = SINE.partition("[[run]]")[0]
    for number, (level, heights) in enumerate([(1, (1.0, 0.8)), (1, (0.8, 1.0)), (3, (0.7, 1.0)), (3, (0.9, 1.0))]):
        parts = [
            height * 2 * ratio / (1 - (lines / own) ** 2 + 2j * ratio * lines / own)
            for own, height in zip(natural, heights, strict=True)
        ]
        value = 1e-6 * level * np.sum(parts, axis=0)
        rows = [f"{f:.9g},{abs(x):.9g},{np.angle(x):.9g}" for f, x in zip(lines, value, strict=True)]
        (folder / "tests" / f"sine{number}.csv").write_text("\n".join(["f,x,angle", *rows]), encoding="utf-8")
        entry = SINE.partition("[[run]]")[2].replace("level = 1", f"level = {level}\nrepeat = {1 + number % 2}")
        manifest += "[[run]]" + entry.replace("sine.csv", f"sine{number}.csv")
    text = MANIFEST.partition("[[loop]]")[0] + manifest
    (folder / "tests" / "campaign.toml").write_text(text, encoding="utf-8")
    result = list(find_resonances(read_campaign(folder / "tests")))
    # The flank of the other mode is 6 % of a peak, and shifts it by about as much of its width, which is 2 Hz.
    assert [item.frequency for item in result] == pytest.approx(natural, abs=0.15)
    assert [item.damping for item in result] == pytest.approx([ratio, ratio], rel=0.06)
    assert all(item.frequency_deviation < 0.15 for item in result)
    assert all(item.is_steady for item in result)
    assert [item.is_largest for item in result] == [True, False]
    assert len({item.source for item in result}) == 2


def test_a_repeat_of_one_point_beside_a_resonance_does_not_hide_it(folder: Path) -> None:
    lines = np.linspace(90.0, 110.0, 41)
    manifest = SINE.partition("[[run]]")[0]
    for number, frequency in enumerate((lines, lines[:1]), start=1):
        value = 1e-6 / (1 - (frequency / 100.0) ** 2 + 0.02j * frequency / 100.0)
        rows = [f"{f:.9g},{abs(x):.9g},{np.angle(x):.9g}" for f, x in zip(frequency, value, strict=True)]
        (folder / "tests" / f"sine{number}.csv").write_text("\n".join(["f,x,angle", *rows]), encoding="utf-8")
        manifest += SINE[SINE.index("[[run]]") :].replace('"sine.csv"', f'"sine{number}.csv"\nrepeat = {number}')
    text = MANIFEST.partition("[[loop]]")[0] + manifest
    (folder / "tests" / "campaign.toml").write_text(text, encoding="utf-8")
    (result,) = find_resonances(read_campaign(folder / "tests"))
    assert result.frequency == pytest.approx(100.0, rel=1e-6)  # nine digits in the file


def test_an_estimate_needs_no_repeats(folder: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    rows = [f"{f:g},{1e-6 * f:.6g},0.1" for f in (90.0, 100.0, 110.0)]
    (folder / "tests" / "sine.csv").write_text("\n".join(["f,x,angle", *rows]), encoding="utf-8")
    with (folder / "tests" / "campaign.toml").open("a", encoding="utf-8") as manifest:
        manifest.write(SINE)
    estimates: list[dict[str, object]] = run(folder, capfdbinary)["estimates"]  # type: ignore[assignment]
    assert {"kt", "mu", "zeta"} <= {str(item["parameter"]) for item in estimates}


def test_what_looks_wrong_in_the_data_is_said_beside_the_estimates(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    frequency = np.linspace(90.0, 110.0, 21)
    response = 1 / (100.0**2 - frequency**2 + 2j * 0.01 * 100.0 * frequency)
    rows = [f"{f:.6g},{abs(x):.6g},{np.degrees(np.angle(x)):.6g}" for f, x in zip(frequency, response, strict=True)]
    for name in ("sine.csv", "again.csv"):
        (folder / "tests" / name).write_text("\n".join(["f,x,angle", *rows]), encoding="utf-8")
    with (folder / "tests" / "campaign.toml").open("a", encoding="utf-8") as manifest:
        again = SINE.partition("[[run]]")[2].replace('"sine.csv"', '"again.csv"\nrepeat = 2')
        manifest.write(f"{SINE}[[run]]{again}")
    suspicions: list[str] = run(folder, capfdbinary)["suspicions"]  # type: ignore[assignment]
    # Both files at once.
    (result,) = (sentence for sentence in suspicions if "174 rad" in sentence)
    assert "sine.csv" in result
    assert "again.csv" in result


def test_text_has_no_sign_for_a_missing_unit_and_damping_is_not_below_zero(
    folder: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    manifest = folder / "tests" / "campaign.toml"
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(text.replace('damping_deviation = "0.001 %"', 'damping_deviation = "0.5 %"'), encoding="utf-8")
    assert main(["estimate", str(folder / "chain.toml"), str(folder / "tests")]) == 0
    lines = capfdbinary.readouterr().out.decode().splitlines()
    # 0.6 % less 1.96 times 0.5 %, and 3 % of 0.6 %, would be below zero.
    assert [line for line in lines if line.startswith("zeta     0.006 (0 to 0.01581)")]
    assert not [line for line in lines if " - (" in line]
