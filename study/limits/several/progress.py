"""Progress of a search for several limits, as a fraction of its work."""

from collections.abc import Callable

from hbsolve.limits.several_limits import SeveralProgress

#: Fraction of the work of one objective at the end of each stage, measured on the beam; sampling is common to all.
STAGE_END = {
    "population": 0.2,
    "neighbours": 0.4,
    "perturbations": 0.7,
    "levels": 0.75,
    "gaps": 0.95,
    "certificates": 1.0,
}


class SeveralSearchProgress:
    """Converter of reports of a search into increasing progress; tasks that were stored earlier do not count.

    Parameters
    ----------
    report
        Function that reports the progress of the step.
    """

    def __init__(self, report: Callable[[float, float], None]) -> None:
        self._report = report
        self._before = self._done = 0.0
        self._computed = False

    def __call__(self, progress: SeveralProgress) -> None:
        """See `several_limits`."""
        stage, part = progress.stage, progress.stage.done / max(progress.stage.total, 1)
        if stage.stage == "shared histories":
            work = progress.shared * part
        else:
            names = list(STAGE_END)
            number = names.index(stage.stage)
            begin = STAGE_END[names[number - 1]] if number else 0.0
            work = progress.before + begin + (STAGE_END[stage.stage] - begin) * part
        self._done = max(self._done, work / progress.total)
        if not self._computed:
            self._before = self._done
            self._computed = stage.done < stage.total
        elif self._done > self._before:
            self._report(self._done - self._before, 1 - self._before)
