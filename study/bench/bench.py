"""The calls of the bench; each returns named numbers and the parts of the page that have changed.

The page, its worker process and an exported script make the same calls::

    bench = Bench(Path("beam.toml"), Path("campaign"), run)
    bench.compare().numbers
    bench.diagnose()
    bench.add("mass at tip")
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.errors import CampaignError
from correlation.metric.misfit import summarise_misfit
from correlation.prediction import Points
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.threshold.detection_threshold import compute_linear_thresholds
from pipeline.output import prepare_output, replace_file
from study.bench.case_text import hash_text
from study.bench.copied_case import use_effect_copies
from study.bench.data_without_states import (
    compare_data_campaign,
    diagnose_data_campaign,
    move_data_parameters,
    screen_data_campaign,
)
from study.bench.line import Lines, find_lines, list_unknowns, move_lines, move_values
from study.bench.own_effect import OwnFile, save_own_effect, show_own_effects
from study.bench.view.candidate import show_diagnosis, show_scores
from study.bench.view.comparison import list_errors, show_comparison, show_moved
from study.bench.view.finding import show_law, show_next_tests
from study.bench.view.history import list_numbers, show_errors, show_history
from study.bench.view.limits import count_limits, show_limits
from study.bench.view.operation import list_operations
from study.bench.view.parameter import show_fitted, show_parameters
from study.bench.view.structure import show_structure
from study.case.setup import ReadCase, Setup, read_case, require_loads
from study.compare.curve import Coefficients, Drawing
from study.compare.families import find_families
from study.compare.result import ComparisonResult
from study.compare.run import find_comparison, hash_comparison
from study.compare.suspicions import require_noise
from study.diagnose.add import CaseEditError, add, undo
from study.diagnose.calibrate import calibrate_case, screen_campaign
from study.diagnose.history import DIAGNOSIS, HistoryStep, hash_case, history_of, read_text
from study.diagnose.round import Steps, summarise_errors
from study.diagnose.run import diagnose_file
from study.diagnose.stages import make_waterfall
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.run_context import RunContext, silent_run


@dataclass(frozen=True, kw_only=True)
class CallResult:
    """Result of a call.

    Parameters
    ----------
    numbers
        Named numbers and words; reproducible, so that a repeated call gives the same.
    views
        Changed parts of the page, as plain data.
    """

    numbers: Mapping[str, float | str]
    views: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Comparison:
    """A comparison with its predicted lines, and the text of the compared case."""

    text: str
    read: ReadCase
    compared: ComparisonResult
    unknowns: Unknowns
    values: Values
    lines: Mapping[str, Lines]

    @property
    def drawn(self) -> dict[bool, tuple[Points, Coefficients]]:
        """Lines at the values of the case, by whether the contacts are absent."""
        return {name == "free": (item.points, item.prediction.value) for name, item in self.lines.items()}


class Bench:
    """A case and a campaign, with the calls of the bench.

    Parameters
    ----------
    case, folder
        Case file, and folder of the campaign.
    run
        Store and progress; by default nothing is stored or shown.
    without
        Kinds of effects to leave out.
    is_copy
        Whether the case is a copy from `study.bench.copied_case.copy_beside`, with effect files in a separate folder.
    """

    def __init__(
        self, case: Path, folder: Path, run: RunContext | None = None, without: Sequence[str] = (), *,
        is_copy: bool = False,
    ) -> None:  # fmt: skip
        self.case, self.folder = Path(case), Path(folder)
        self.run, self.without, self.is_copy = run or silent_run(), tuple(without), is_copy
        self._comparison: _Comparison | None = None

    def compare(self) -> CallResult:
        """Compare the case with the measurements, as `stickslip compare` does.

        Raises
        ------
        CaseError, CampaignError
            The case or the campaign has mistakes.
        """
        campaign = self._read_campaign()
        if campaign.has_only_typed_data:
            seen, self._comparison = hash_text(read_text(self.case)), None
            found_alone, shown = compare_data_campaign(self.case, campaign, self.run)
            shown["verdict"]["seen"] = seen
            return CallResult(numbers=found_alone, views=shown)
        self._comparison = result = self._compare(campaign)
        compared, history = result.compared, history_of(self.case)
        with self.run.progress.step("page", expected=2):
            views = show_comparison(compared, result.lines)
            views["verdict"]["seen"] = hash_text(result.text)
            views["parameters"] = show_parameters(result.read.setup, result.unknowns, result.values, history)
            operations = list_operations(compared.model, compared.prediction, compared.campaign.drive.unit)
            make_surfaces = result.read.structure.surfaces
            surfaces = {} if make_surfaces is None else make_surfaces()
            views["structure"] = show_structure(compared.model, surfaces, operations)
            views["own"] = show_own_effects(self.case, result.read.setup.model)
        views["history"] = show_history(history)
        numbers = {"training deviations [-]": summarise_misfit(compared.train).whitened}
        if compared.held_out is not None:
            numbers["held-out deviations [-]"] = summarise_misfit(compared.held_out).whitened
        return CallResult(numbers={**numbers, **list_errors(compared, result.drawn)}, views=views)

    def screen(self) -> CallResult:
        """Screen the effects, which is the first part of `stickslip diagnose`.

        Raises
        ------
        CaseError, CampaignError, EffectError
            The case, the campaign or an effect file has mistakes.
        """
        campaign = self._read_campaign()
        if campaign.has_only_typed_data:
            return CallResult(numbers={}, views=screen_data_campaign())
        open_case(self.case)  # mistakes of the file itself come first
        screened = screen_campaign(self.case, campaign, self.folder, self.run, self.without)
        history = history_of(self.case)
        drawn, now = summarise_errors(screened.uncalibrated), summarise_errors(screened.baseline)
        added = [item.effect.name for item in screened.setup.added]
        unknowns, fit = screened.baseline.fit.unknowns, screened.baseline.fit
        best = screened.scores[0] if screened.scores else None
        views = {
            "candidates": {
                "rows": show_scores(screened.scores),
                "verdict": None,
                "chance": float(compute_linear_thresholds(screened.scores).gain),
            },
            "errors": show_errors(history, added, drawn, now),
            "fitted": show_fitted(unknowns.names, unknowns.parameters, fit.values, fit.deviation),
            "law": None,
            "next_test": None,
            "is_diagnosed": self._is_diagnosed(screened.setup),
        }
        numbers: dict[str, float | str] = {**list_numbers(drawn, now)}
        if best is not None:
            numbers |= {"best by first order": best.effect.name, "chi^2 falls by [-]": best.gain}
        return CallResult(numbers=numbers, views=views)

    def diagnose(self) -> CallResult:
        """Diagnose the case as `stickslip diagnose` does, and record the verdict in its history.

        Raises
        ------
        CaseError, CampaignError, EffectError
            The case, the campaign or an effect file has mistakes.
        """
        campaign = self._read_campaign()
        if campaign.has_only_typed_data:
            result, alone = diagnose_data_campaign(self.case, campaign, self.folder, self.run, self.without)
            return CallResult(numbers=result, views=alone)
        diagnosed = diagnose_file(self.case, campaign, self.folder, self.run, without=self.without)
        shown = show_diagnosis(diagnosed.last)
        best = diagnosed.last.best
        before = summarise_errors(diagnosed.last.diagnosis.baseline)
        after = None if best is None or best.effect is None else summarise_errors(best)
        views = {
            "candidates": {"rows": shown.pop("candidates"), "verdict": shown, "chance": shown.pop("chance")},
            "law": show_law(diagnosed.last),
            "next_test": show_next_tests(diagnosed.last),
            "history": show_history(diagnosed.history),
            "errors": [vars(step) for step in make_waterfall(diagnosed.last, diagnosed.history)],
        }
        return CallResult(
            numbers={"finding": shown["finding"], "verdict": shown["sentence"], **list_numbers(before, after)},
            views=views,
        )

    def add(self, effect: str, values: Sequence[str] = (), seen: str | None = None) -> CallResult:
        """Write an effect into the case, as `stickslip add` does.

        Parameters
        ----------
        effect, values
            Name and values of the effect, see `stickslip add`; by default the values of the last diagnosis.
        seen
            `hash_text` of the case that the page shows; by default it is not checked.

        Raises
        ------
        CaseEditError
            The case differs from the one that the page shows, or an error of `stickslip add`.
        """
        self._require_seen(seen)
        return self._written(add(self.case, effect, values, self.run))

    def undo(self, count: int = 1, seen: str | None = None) -> CallResult:
        """Undo steps, as `stickslip undo` does; for `seen` see `add`.

        Raises
        ------
        CaseEditError
            The case differs from the one that the page shows, or an error of `stickslip undo`.
        """
        self._require_seen(seen)
        if count < 1:
            raise CaseEditError(f"{count} steps cannot be taken back: give 1 or more")
        for _ in range(count):
            step = undo(self.case)
        return self._written(step)

    def calibrate(self, seen: str | None = None) -> CallResult:
        """Write the fitted calibration parameters into the case, as `stickslip calibrate` does; for `seen` see `add`.

        Raises
        ------
        CaseEditError
            The case differs from the one that the page shows, or an error of `stickslip calibrate`.
        """
        self._require_seen(seen)
        return self._written(calibrate_case(self.case, self.folder, self.run, self.without))

    def move(self, values: Mapping[str, float]) -> CallResult:
        """Compute exact curves, or features of typed data, for other values of some parameters; the case is unchanged.

        Parameters
        ----------
        values
            Values by the names of parameters [SI; factors -].

        Raises
        ------
        InputError
            A parameter that the case does not have.
        """
        # A slider of the page moves many times: files are read only the first time.
        if self._comparison is None and (campaign := self._read_campaign()).has_only_typed_data:
            numbers_alone, views = move_data_parameters(self.case, campaign, self.run, values)
            return CallResult(numbers=numbers_alone, views=views)
        current = self._current()
        moved = move_values(current.unknowns, current.values, values, self.case)
        with self.run.progress.step("exact curves", expected=3):
            lines = move_lines(current.compared, current.lines, current.unknowns, moved)
            shown, numbers = show_moved(current.compared, lines)
        return CallResult(numbers={**numbers}, views={"moved": {**shown, "values": dict(values)}})

    def limits(self) -> CallResult:
        """Compare measured families with the limits of all friction histories, as `stickslip compare --limits` does.

        Results of a cancelled search are stored, and the same call continues from there.
        """
        result = self._current()
        setup, compared, case = result.read.setup, result.compared, result.read.opened.case
        with TemporaryDirectory(prefix="stickslip-") as passing:
            folder = self.run.store.folder
            run = replace(self.run, output=prepare_output(Path(passing) if folder is None else folder / "bench"))
            families = find_families(
                compared.model, setup.complete_budget, compared.campaign, case.limits, result.read.structure, run,
                stem=hash_text(str(self.case.resolve()))[:16],
            )  # fmt: skip
        drawing = Drawing.of(compared, result.drawn)
        panels = [(free, panel) for free, listed in drawing.panels.items() for panel in listed if panel.curves]
        return CallResult(numbers=count_limits(families), views={"limits": show_limits(families, panels)})

    def save_effect(self, file: str, text: str, seen: str | None = None, before: str | None = None) -> CallResult:
        """Write an effect file beside the case, and its name into the case; with a mistake nothing is written.

        Parameters
        ----------
        file
            Name of a file that the case names, or of a new file.
        text
            Source of the file.
        seen
            See `add`.
        before
            `hash_text` of the source that the page shows, empty for a new file; by default it is not checked.

        Raises
        ------
        EffectError
            The file has a mistake; the message has its line.
        CaseEditError
            The case or the file differs from the one that the page shows.
        UntrustedCode
            Other users may change the folder, and the user does not trust them.
        """
        self._require_seen(seen)
        own = OwnFile(case=self.case, name=file, is_copy=self.is_copy)
        if before is not None and own.hash != before:
            raise CaseEditError(
                f"{own.path} was changed since the page showed it, and nothing was written: reload the page"
            )
        numbers, model = save_own_effect(own, text, self._read_campaign(), self.run)
        return CallResult(numbers=numbers, views={"own": show_own_effects(self.case, model)})

    def edit(self, text: str) -> CallResult:
        """Replace the text of the case, as an editor does."""
        replace_file(self.case, (use_effect_copies(self.case, text) if self.is_copy else text).encode("utf-8"))
        return CallResult(numbers={})

    def _current(self) -> _Comparison:
        """Return the comparison of the current case."""
        result = self._comparison
        if result is None or result.text != read_text(self.case):
            self._comparison = result = self._compare(self._read_campaign())
        return result

    def _compare(self, campaign: Campaign) -> _Comparison:
        if not len(campaign.measurement):
            raise CampaignError(
                f"{self.folder} has no steady states, whose curves could be moved or laid over limits: add some"
            )
        require_noise(campaign, self.folder)
        text = read_text(self.case)
        read = require_loads(read_case(self.case, campaign, self.run))
        compared = find_comparison(read.setup, campaign, self.run)
        unknowns, values = list_unknowns(read.setup, campaign)
        key = hash_comparison(read.setup, campaign)
        step = self.run.step("curves and their sensitivities", expected=10)
        lines = step.run(find_lines, key, compared, unknowns, values)
        return _Comparison(text=text, read=read, compared=compared, unknowns=unknowns, values=values, lines=lines)

    def _read_campaign(self) -> Campaign:
        return read_measured(self.folder, self.run)

    def _is_diagnosed(self, setup: Setup) -> bool:
        """Whether a diagnosis of the current case is stored, so that it takes no time."""
        key = hash_case(read_text(self.case))
        if not any(step.what == DIAGNOSIS and step.case_key == key for step in history_of(self.case).steps):
            return False
        without = tuple(sorted({*setup.without, *self.without}))
        return Steps(self.run.store, setup, self._read_campaign(), without).is_stored("places")

    def _require_seen(self, seen: str | None) -> None:
        if seen is not None and hash_text(read_text(self.case)) != seen:
            raise CaseEditError(
                f"{self.case.name} was changed since the page showed it, by hand or in another page, and nothing was "
                "written: check its current state, and click again"
            )

    def _written(self, step: HistoryStep) -> CallResult:
        return CallResult(
            numbers=list_numbers(step.before, step.after), views={"history": show_history(history_of(self.case))}
        )
