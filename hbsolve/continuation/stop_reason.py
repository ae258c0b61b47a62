"""Reasons why a curve of periodic responses ends."""

from enum import Enum

from hbsolve.errors import BalanceError, Failure


class StopReason(Enum):
    """Reason why a curve ends; the value is the reason and, after a colon, advice."""

    REACHED = "reached the last value"
    SOLVED = "solved at all frequencies"
    TURNED_BACK = "turned back beyond its first value: begin further away, or follow the curve in the other direction"
    CLOSED = "the branch closes on itself (it has left the one it began on): continue from another state"
    ISOLA = "it is an isola, a separate closed curve"
    MOST_POINTS = "reached the largest number of points: allow more points or longer steps"
    FOLDED = (
        "many folds in succession, so that the largest number of points is reached: branches of stick and slip lie "
        "close together, as with large friction coefficients; reduce these"
    )
    DRIFTED = f"a body that is held only by joints drifts: {Failure.DRIFT.value}"
    UNSETTLED = f"the state of a joint does not repeat every period: {Failure.MEMORY.value}"
    FAILED = "the corrections fail even for the smallest step: continue from another state, or with more harmonics"

    def sentence(self, where: str = "") -> str:
        """Reason and advice, with the place where the curve ends if one is given."""
        what, colon, advice = self.value.partition(":")
        return f"{what}, at {where}{colon}{advice}" if where else self.value

    @classmethod
    def read(cls, text: str) -> "StopReason":
        """Reason given in a file, by name or, in older files, by the beginning of a sentence; else a `BalanceError`."""
        for reason in cls:
            if text == reason.name or text.startswith(_OLDER_SENTENCES[reason]):
                return reason
        raise BalanceError(f'"{text}" is not a stop reason: choose one of {", ".join(cls.__members__)}')


#: Beginnings of the sentences in older files, compared in the order of the members.
_OLDER_SENTENCES = {
    StopReason.REACHED: "reached the last value",
    StopReason.SOLVED: "all ",
    StopReason.TURNED_BACK: "turned back",
    StopReason.CLOSED: "the branch closes",
    StopReason.ISOLA: "it is an isola",
    StopReason.MOST_POINTS: "reached ",
    StopReason.FOLDED: "folds again",
    StopReason.DRIFTED: "a body that joints",
    StopReason.UNSETTLED: "the state of a joint",
    StopReason.FAILED: "the corrections fail",
}
