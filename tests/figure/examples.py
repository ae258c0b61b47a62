"""A result of each kind that a figure draws: the smallest that shows all of its parts."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from correlation.data_type.registry import Panel
from figure.backbone import BackboneCurve, Backbones
from figure.candidates import CandidateBar, Candidates
from figure.confusion import ConfusionMatrix
from figure.contact_states import ContactStates, StatePanel
from figure.family_over_limits import FamiliesOverLimits, FamilyPanel, FamilyRow, MeasuredCurve
from figure.fdac_map import FdacMap
from figure.force_limits import ForceLimits, LineForceLimits
from figure.force_surface import ForceCurve, ForceSurface
from figure.frequency_response import ReceptanceCurve
from figure.frf_overlay import FrfOverlay, OverlayCurve, OverlayPanel
from figure.hysteresis_loops import HysteresisLoop, HysteresisLoops
from figure.limit_band import Band, LimitBands
from figure.limit_levels import LimitsByLevel
from figure.line_force_bands import LineForceBands
from figure.line_forces import LineForce, LineForces
from figure.line_states import LineStates, StateHistories
from figure.mac_matrix import MacMatrix
from figure.measured_data import MeasuredData
from figure.mesh_study import MeshConvergence, ModelFrequency
from figure.misfit_map import MapPanel, MisfitMap
from figure.missing_law import BandedCurve, KnownLaw, LawDrawing, LevelLoop
from figure.next_test import NextTests, PredictedCurve, TestBar
from figure.parameter_curves import ParameterCurve, ParameterCurves
from figure.parameter_intervals import IntervalPanel, ParameterIntervals
from figure.parameter_trends import ParameterTrends, TrendLine
from figure.reactions import Reaction, Reactions
from figure.response_curves import CurveMark, DrawnCurve, ResponseCurves
from figure.response_spread import ResponseSpread, SpreadBand
from figure.ring_down import DecayDrawing
from figure.small_responses import SmallResponsePanel, SmallResponses
from figure.stabilisation import StabilisationDrawing
from figure.test_plan import PlanDrawing
from figure.tornado import Tornado
from figure.variance_shares import SharePanel, VarianceShares
from figure.waterfall import Waterfall, WaterfallStep

FREQUENCY = np.linspace(90.0, 110.0, 41)
TIME = np.arange(32) / 32
SINE, COSINE = np.sin(2 * np.pi * TIME), np.cos(2 * np.pi * TIME)
TITLES = {"title": "Title", "subtitle": "Subtitle"}


def receptance(resonance: float, damping_ratio: float = 0.01) -> np.ndarray:
    """Of one mass on a spring of 1 N/m."""
    ratio = FREQUENCY / resonance
    return 1 / (1 - ratio**2 + 2j * damping_ratio * ratio)


def missing_law() -> LawDrawing:
    x = np.linspace(-1e-3, 1e-3, 33)
    spring = BandedCurve(x=x, mean=1e9 * x**3, low=1e9 * x**3 - 0.1, high=1e9 * x**3 + 0.1)
    amplitude = BandedCurve(x=x[17:], mean=1e9 * x[17:] ** 2, low=0.9e9 * x[17:] ** 2, high=1.1e9 * x[17:] ** 2)
    loops = [
        LevelLoop(label=f"{n} N", displacement=n * 5e-4 * COSINE, velocity=-n * 0.1 * SINE, force=0.1 * n * COSINE**3)
        for n in (1, 2)
    ]
    return LawDrawing(
        loops=loops, spring=spring, damper=spring, stiffness=amplitude, work=amplitude, is_hatched=True,
        known=[KnownLaw(label="nearest linear", force=600 * x)], **TITLES,
    )  # fmt: skip


def response_curves() -> ResponseCurves:
    curves = [
        DrawnCurve(label=f"{level} N", parameter=FREQUENCY, response=level * receptance(100 - level / 10))
        for level in (1, 2, 5)
    ]
    # A curve that turns back.
    back = np.concatenate([FREQUENCY, FREQUENCY[-2:20:-1]])
    response = np.linspace(0.5, 9.0, len(back)) * np.exp(-1j)
    marks = [CurveMark(label="fold", parameter=back[40], response=response[40])]
    curves.append(DrawnCurve(label="fold", parameter=back, response=response, unstable=back > 105, marks=marks))
    backbone = DrawnCurve(label="backbone", parameter=FREQUENCY, response=np.linspace(0.1, 40.0, 41) + 0j)
    return ResponseCurves(
        curves=curves,
        title="Title",
        parameter_label="frequency [Hz]",
        amplitude_label="tip [um]",
        backbone=backbone,
    )


def contact_states() -> ContactStates:
    share = np.stack([np.linspace(0.8, 0.2, 41), np.linspace(0.1, 0.5, 41), np.linspace(0.1, 0.3, 41)], axis=1)
    panel = StatePanel(label="joint", parameter=FREQUENCY, states=("stuck", "slipping", "separated"), share=share)
    return ContactStates(panels=[[panel, panel], [panel, panel]], title="Title", parameter_label="frequency [Hz]")


def hysteresis_loops() -> HysteresisLoops:
    loops = [
        HysteresisLoop(
            label=f"{level} N", time=TIME, displacement=1e-6 * level * SINE, force=level * COSINE, normal=9 + SINE
        )
        for level in (1, 2)
    ]
    return HysteresisLoops(joints=[("one", loops), ("two", loops)], title="Title")


def limit_bands() -> LimitBands:
    upper = np.abs(receptance(100.0))
    jump = np.zeros((2, 41), dtype=bool)
    jump[1, 20] = True
    band = Band(
        label="1 N", frequency=FREQUENCY, value=np.array([0.5 * upper, upper]), jump=jump, repaired=jump[::-1],
        sampled=np.linspace(0.6, 0.9, 5)[:, None] * upper,
    )  # fmt: skip
    return LimitBands(bands=[band] * 3, title="Title", amplitude_label="tip [um]")


def line_force_bands() -> LineForceBands:
    return LineForceBands(bands={"T0": limit_bands().bands, "N1": limit_bands().bands}, title="Title")


def limits_by_level() -> LimitsByLevel:
    value = np.array([[1.0, 2.0, 4.0], [1.5, 4.0, 9.0]])
    return LimitsByLevel(
        level=np.array([1.0, 2.0, 5.0]), value=value, frequency=100 - value, doubtful=value > 5, title="Title",
        amplitude_label="tip [um]",
    )  # fmt: skip


def force_limits() -> LineForceLimits:
    value = np.array([[-2.0, 0.5], [1.0, 3.0]])
    panels = [
        ForceLimits(line=line, force=force, level=np.array([1.0, 4.0]), value=value, sampled=value)
        for line in ("left", "right")
        for force in ("T0", "N0")
    ]
    return LineForceLimits(panels=panels, title="Title", sampled_label="tests")


def line_forces() -> LineForces:
    forces = [
        LineForce(name=name, label=f"{level} N", time=TIME, tangential=level * SINE, normal=9 + level * COSINE)
        for name in ("left", "right")
        for level in (1, 4)
    ]
    return LineForces(forces=forces, friction_coefficient={"left": 0.8, "right": 0.5}, **TITLES)


def families_over_limits() -> FamiliesOverLimits:
    upper = np.abs(receptance(100.0))
    jump = np.zeros((2, 41), dtype=bool)
    jump[1, 20] = True
    curves = [
        MeasuredCurve(
            repeat=repeat, sweep=sweep, frequency=FREQUENCY[::4], value=(0.7 + 0.2 * repeat) * upper[::4],
            outside=np.full(11, repeat == 2),
        )
        for repeat in (1, 2)
        for sweep in (1, -1, 0)
    ]  # fmt: skip
    panel = FamilyPanel(
        label="1 N", frequency=FREQUENCY, limit=np.array([0.5 * upper, upper]), jump=jump, curves=curves
    )
    one = FamilyPanel(
        label="3 N", frequency=FREQUENCY[:1], limit=np.array([[0.5], [1.0]]), jump=jump[:, :1], curves=curves[:1]
    )
    return FamiliesOverLimits(
        rows=[FamilyRow(label="tip [um]", panels=[panel, panel]), FamilyRow(label="T [N]", panels=[one], share=True)],
        **TITLES,
    )


def misfit_map() -> MisfitMap:
    panels = [
        MapPanel(sensor=sensor, harmonic=harmonic, size=np.linspace(0, 30, 3 * 41).reshape(3, 41))
        for sensor in ("tip", "root")
        for harmonic in (1, 3)
    ]
    return MisfitMap(panels=panels, levels=["1 N", "2 N", "5 N"], frequency=FREQUENCY, **TITLES)


def frf_overlay() -> FrfOverlay:
    curves = [
        OverlayCurve(
            level=number, frequency=FREQUENCY[::4], measured=receptance(100 - number)[::4],
            deviation=np.full(11, 0.2), predicted=receptance(99.5 - number)[::4], line_frequency=FREQUENCY,
            line=receptance(99.5 - number),
        )
        for number in range(2)
    ]  # fmt: skip
    panels = [OverlayPanel(label=name, unit="um/N", curves=curves) for name in ("tip", "root", "side")]
    return FrfOverlay(panels=panels, levels=["1 N", "5 N"], columns=2, with_phase=True, **TITLES)


def mesh_convergence() -> MeshConvergence:
    rows = [
        ModelFrequency(
            element=element, through_thickness=n, frequency=120 + 6 / n, reference=120.1 + 6 / n, number=n,
            is_full=n != 2,
        )
        for element in ("hex8", "hex20")
        for n in (1, 2, 3)
    ]  # fmt: skip
    untuned = [ModelFrequency(element="hex8", through_thickness=4, frequency=121.4, reference=121.5)]
    return MeshConvergence(rows=rows, untuned=untuned, measured=122.25, title="Title")


def backbones() -> Backbones:
    amplitude = np.geomspace(1, 100, 30)
    curves = [
        BackboneCurve(
            label=f"a long name of a ring-down: {kind}", kind=kind, amplitude=amplitude[::step],
            reference=100.0, frequency=100 - np.log(amplitude[::step]) / 10,
            frequency_deviation=np.full(len(amplitude[::step]), 0.01), damping=0.01 + 1e-5 * amplitude[::step],
            damping_deviation=np.full(len(amplitude[::step]), 1e-4),
        )
        for kind, step in (("decay", 1), ("levels", 7), ("model", 1))
    ]  # fmt: skip
    return Backbones(curves=curves, amplitude_label="amplitude [um]", **TITLES)


def decay_drawing() -> DecayDrawing:
    time = np.linspace(0, 1, 500)
    amplitude = np.exp(-5 * time)
    return DecayDrawing(
        time=time, signal=amplitude * np.cos(60 * time), modes=[("mode at 10 Hz", time[5:], amplitude[5:])], floor=1e-2,
        signal_label="displacement [um]", **TITLES,
    )  # fmt: skip


def stabilisation_drawing() -> StabilisationDrawing:
    order = np.repeat(np.arange(3, 13), 2)
    return StabilisationDrawing(
        order=order, frequency=np.tile([98.0, 103.0], 10), stable=order > 5, line=FREQUENCY,
        response=np.abs(receptance(98.0)), fitted=np.abs(receptance(98.0)), chosen=np.array([98.0]),
        response_label="receptance [um/N]", **TITLES,
    )  # fmt: skip


#: One result per kind, made when it is asked for.
def parameter_curves() -> ParameterCurves:
    curves = [
        ParameterCurve(value=value, line=line, along=FREQUENCY, amplitude=value * np.abs(receptance(98 + 2 * line)))
        for value in (0.5, 1.0, 2.0)
        for line in range(2)
    ]
    return ParameterCurves(
        panels=[(f"level {level}", curves) for level in (1, 2, 3)],
        colour_label="factor mu [-]",
        lines=("zeta = 1", "zeta = 2"),
        along_label="frequency [Hz]",
        amplitude_label="amplitude [um]",
        **TITLES,
    )


def parameter_trends() -> ParameterTrends:
    value = np.linspace(0.5, 2.0, 5)
    trends = [
        TrendLine(
            group=group, line=line, value=value, quantity=np.array([99 + value * line, 10**value, value * group]),
            doubtful=value > 1.5,
        )
        for group in range(2)
        for line in range(2)
    ]  # fmt: skip
    return ParameterTrends(
        trends=trends,
        groups=("level 1", "level 2"),
        lines=("zeta = 1", "zeta = 2"),
        quantity_labels=("peak frequency [Hz]", "peak amplitude [um]", "equivalent damping ratio [%]"),
        parameter_label="factor mu [-]",
        **TITLES,
    )


def response_spread() -> ResponseSpread:
    nominal = np.abs(receptance(100.0))
    quantiles = np.array([0.8, 1.0, 1.3])[:, None] * nominal
    band = SpreadBand(
        label="", colour="#0072b2", along=FREQUENCY, quantiles=quantiles, nominal_along=FREQUENCY, nominal=nominal,
        first_order=np.array([0.7 * nominal - 1, 1.6 * nominal]),
    )  # fmt: skip
    bands = [replace(band, label=f"{side} limit", first_order=None) for side in ("upper", "lower")]
    return ResponseSpread(
        panels=[("level 1", [band]), ("level 2", bands), ("level 3", [band])],
        along_label="frequency [Hz]",
        amplitude_label="amplitude [um]",
        **TITLES,
    )


def variance_shares() -> VarianceShares:
    first = np.array([[0.7, 0.2, -0.01], [0.5, np.nan, 0.1]])
    panel = SharePanel(
        label="of the peak amplitude", first=first, total=first + 0.1, interval=np.array([first - 0.1, first + 0.3]),
        linear=np.array([[0.8, 0.2, 0.0], [0.6, 0.3, 0.1]]),
    )  # fmt: skip
    return VarianceShares(
        panels=[panel] * 3, groups=("level 1", "level 2"), parameters=("mu", "wall.preload", "zeta"), **TITLES
    )


def force_surface() -> ForceSurface:
    amplitude = np.geomspace(1.0, 50.0, 9)
    force = amplitude[:, None] / np.abs(receptance(100.0))
    force[-1, :10] = np.nan
    response = np.abs(receptance(100.0))
    curves = [
        ForceCurve(label=f"{level} N", pieces=[(FREQUENCY[inside], level * response[inside])])
        for level in (0.5, 0.9)
        for inside in [(level * response > 1) & (level * response < 50)]
    ]
    return ForceSurface(
        frequency=FREQUENCY, amplitude=amplitude, force=force, amplitude_label="tip [um]", force_label="force [N]",
        curves=curves, **TITLES,
    )  # fmt: skip


def small_responses() -> SmallResponses:
    panels = [
        SmallResponsePanel(
            label=label, frequency=FREQUENCY[::9], measured=np.abs(receptance(100.0))[::9], line_frequency=FREQUENCY,
            lines={f"iteration {number}": np.abs(receptance(99.0 + number)) for number in range(3)},
        )
        for label in ("(a) free", "(b) stuck")
    ]  # fmt: skip
    return SmallResponses(panels=panels, **TITLES)


def parameter_intervals() -> ParameterIntervals:
    panels = [
        IntervalPanel(
            label=label, truth=truth,
            ways={"by hand": (1.1, 0.9, 1.3), "automatic": (1.02, 0.97, 1.07), "drawn": (1.2, 1.2, 1.2)},
        )
        for label, truth in (("kt [N/um]", 1.0), ("mu [-]", 1.05), ("left shift [mm]", None))
    ]  # fmt: skip
    return ParameterIntervals(panels=panels, **TITLES)


def tornado() -> Tornado:
    change = np.array([[-2.0, 2.5], [0.4, -0.3], [0.0, 0.1]])
    changes = {"peak frequency [%]": change, "upper limit [%]": 3 * change[::-1]}
    return Tornado(parameters=["kt (2 %)", "mu (2 %)", "shift (0.1 mm)"], changes=changes, **TITLES)


EXAMPLES: dict[type, Callable[[], object]] = {
    ResponseCurves: response_curves,
    ResponseSpread: response_spread,
    VarianceShares: variance_shares,
    ContactStates: contact_states,
    HysteresisLoops: hysteresis_loops,
    LimitBands: limit_bands,
    LineForceBands: line_force_bands,
    LimitsByLevel: limits_by_level,
    LineForceLimits: force_limits,
    LineForces: line_forces,
    FamiliesOverLimits: families_over_limits,
    MisfitMap: misfit_map,
    ParameterCurves: parameter_curves,
    ParameterTrends: parameter_trends,
    SmallResponses: small_responses,
    ParameterIntervals: parameter_intervals,
    Tornado: tornado,
    FrfOverlay: frf_overlay,
    MeshConvergence: mesh_convergence,
    MeasuredData: lambda: MeasuredData(
        panels=[
            Panel(
                title="loop", x_label="displacement [um]", y_label="force [N]", measured=((SINE, COSINE),),
                predicted=((SINE, 1.1 * COSINE),), is_curve=True,
            )
        ] * 3,
        **TITLES,
    ),
    Backbones: backbones,
    DecayDrawing: decay_drawing,
    StabilisationDrawing: stabilisation_drawing,
    ForceSurface: force_surface,
    FdacMap: lambda: FdacMap(
        assurance=np.cos(np.subtract.outer(FREQUENCY, 1.002 * FREQUENCY)) ** 2, measured=FREQUENCY, model=FREQUENCY,
        **TITLES,
    ),
    MacMatrix: lambda: MacMatrix(
        assurance=np.eye(3, 4), measured=np.array([100.0, 102.0, 105.0]), model=np.array([101.0, 102.5, 106.0, 160.0]),
        pairs=[(0, 0), (1, 1), (2, 2)], **TITLES,
    ),
    ReceptanceCurve: lambda: ReceptanceCurve(frequency=FREQUENCY, receptance=receptance(100.0), title="Title"),
    Reactions: lambda: Reactions(
        reactions=[
            Reaction(name=side, label="1 N", time=TIME, upper=9 + SINE, lower=9 - COSINE) for side in ("left", "right")
        ],
        **TITLES,
    ),
    StateHistories: lambda: StateHistories(
        panels=[[LineStates(name="left", states=np.arange(6 * 32).reshape(6, 32) % 3)] * 2], **TITLES
    ),
    Waterfall: lambda: Waterfall(
        steps=[
            WaterfallStep(
                name=f"step {n}", training=0.3 / n, held_out=0.4 / n, training_chi2=50 / n**3, held_out_chi2=99 / n**3,
                proposed=n == 3,
            )
            for n in (1, 2, 3)
        ],
        **TITLES,
    ),
    Candidates: lambda: Candidates(
        candidates=[
            CandidateBar(
                name=f"effect {n}", gain=10.0 ** (3 - n), is_fitted=n < 2, is_named=n == 0, strength="0.2 +- 0.1 N",
                held_out=0.1 if n < 2 else None,
            )
            for n in range(4)
        ],
        threshold=20.0,
        before=0.3,
        **TITLES,
    ),
    LawDrawing: missing_law,
    NextTests: lambda: NextTests(
        tests=[
            TestBar(name=f"a long name of the test {n}", probability=1.0 - 0.3 * n, minutes=5.0 + 10 * n)
            for n in range(4)
        ],
        frequency=FREQUENCY[::3],
        curves=[
            PredictedCurve(label=f"effect {n}", size=np.abs(receptance(99.0 + n))[::3], deviation=np.full(14, 1.0))
            for n in range(3)
        ],
        reading="tip at 1 N [µm]",
        **TITLES,
    ),
    PlanDrawing: lambda: PlanDrawing(
        names=[f"effect at place {n}" for n in range(6)], smallest=10.0 ** np.linspace(-1.5, 1.8, 6),
        cosines=np.eye(6) + 0.97 * np.eye(6, k=1) + 0.97 * np.eye(6, k=-1), confused=0.95, **TITLES,
    ),
    ConfusionMatrix: lambda: ConfusionMatrix(
        count=np.array([[9, 1], [0, 20]]), right=np.eye(2, dtype=bool), rows=["gap", "nothing"],
        columns=["gap", "nothing"], gaps=([1], [1]), **TITLES,
    ),
}  # fmt: skip
