"""All files of a replay: figures, page, and the numbers as one document."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from figure.registry import pictures
from study.paper.by_hand import make_hand_document
from study.paper.findings import list_findings
from study.paper.page import count_pattern, make_page
from study.paper.pictures import draw_replay
from study.paper.replay import Replay, replay
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperReport:
    """A replay and the files that were written; the page is the last one."""

    result: Replay
    files: tuple[Path, ...]


def write_report(run: RunContext, *, seed: int, like: int, quick: bool) -> PaperReport:
    """Replay the paper, and write everything into the run's output folder; see `study.paper.replay.replay`."""
    result = replay(run, seed=seed, like=like, quick=quick)
    with run.progress.step("figures"):
        drawn = pictures(draw_replay(result))
    written: dict[str, str | bytes] = {f"{name}.png": picture for name, picture in drawn.items()}
    written["paper.html"] = make_page(result, drawn)
    return PaperReport(result=result, files=run.write_files(written))


def make_document(report: PaperReport) -> dict[str, Any]:
    """The document of ``--json``."""
    result = report.result
    same, of = count_pattern(result)
    return {
        "criteria_as_printed": same,
        "n_criteria": of,
        "first_guess": asdict(result.guess),
        **make_hand_document(result.hand),
        "findings": [asdict(item) for item in list_findings(result)],
        "automatic": {
            "rounds": [asdict(item) for item in result.own.rounds],
            "parameters": [asdict(item) for item in result.own.values],
            "others": list(result.own.others),
        },
        "truth": dict(result.truth),
        "files": [str(file) for file in report.files],
    }


def format_report(report: PaperReport) -> str:
    """The same in a few lines."""
    result, words = report.result, {True: "yes", False: "no", None: "-"}
    same, of = count_pattern(result)
    lines = [f"{same} of {of} criteria of Table 2 and figure 16 as printed", "", "  linear      free  stuck  (paper)"]
    lines += [
        f"  {number}           {words[item.own.free_met]:4}  {words[item.own.stuck_met]:5}  "
        f"({words[row.free]}, {words[row.stuck]})"
        for number, (item, row) in enumerate(
            zip(result.hand.linear.iterations, result.case.linear, strict=True), start=1
        )
    ]
    lines += ["", "  nonlinear   response  force  (paper)"]
    lines += [
        f"  {item.number}           {words[item.response.met]:8}  {words[item.force.met]:5}  "
        f"({words[row.response]}, {words[row.force]})"
        for item, row in zip(result.hand.nonlinear.iterations, result.case.nonlinear, strict=True)
    ]
    lines += ["", *(f"  {item.verdict:14} {item.claim}" for item in list_findings(result))]
    lines += ["", "  automatic", *(f"  {item.sentence}" for item in result.own.rounds)]
    return "\n".join([*lines, "", f"page: {report.files[-1]}"])
