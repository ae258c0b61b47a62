"""How far a search for limits is, as one share over all its stages."""

from collections.abc import Callable

from hbsolve.limits.task import StageProgress

#: Where the stages end, as measured on the wedge damper with 100 histories: what is handed on between frequencies and
#: levels has no number of tasks that is known beforehand, and so moves within its share.
END = {
    "population": 0.38, "neighbours": 0.4, "levels": 0.42, "kicks": 0.46, "gaps": 0.51, "audit": 0.98,
    "certificates": 1.0,
}  # fmt: skip
#: Share of the way from which on it tells the time left: the first tasks also read what is compiled.
WORTH_REPORTING = 0.1


class SearchProgress:
    """Turns what a search reports into a share that only grows; what was found in files counts as no work.

    Parameters
    ----------
    report
        Of the step that is shown.
    """

    def __init__(self, report: Callable[[float, float], None]) -> None:
        self._report = report
        self._before = 0.0
        self._done = 0.0
        self._computed = False

    def __call__(self, progress: StageProgress) -> None:
        """See `hbsolve.limits.response_limits`."""
        names = list(END)
        number = names.index(progress.stage)
        begin = END[names[number - 1]] if number else 0.0
        share = begin + (END[progress.stage] - begin) * progress.done / max(progress.total, 1)
        self._done = max(self._done, share)
        # The first task that this run computes begins its clock.
        if not self._computed:
            self._before = self._done
            self._computed = progress.done < progress.total
        elif self._done - self._before > WORTH_REPORTING * (1 - self._before):
            self._report(self._done - self._before, 1 - self._before)
