"""The bars of a terminal: name, bar, percentage, time left. The only file of progress that imports rich."""

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from pipeline.duration import extrapolate, format_duration

# A step that takes longer than last time waits here rather than claim to be done.
NEARLY_DONE = 0.97


class TimeLeft(ProgressColumn):
    """Time left from the finished share, or from the last duration of the step."""

    def render(self, task: Task) -> Text:
        """Time left, or the time so far if nothing is known."""
        elapsed = task.elapsed or 0.0
        guess = task.fields.get("guess")
        if guess:
            left = guess - elapsed
            return Text(
                f"about {format_duration(left)} left"
                if left > 0
                else f"{format_duration(elapsed)}, longer than last time"
            )
        extrapolated = extrapolate(task.completed, task.total or 0.0, elapsed)
        return Text(format_duration(elapsed) if extrapolated is None else f"about {format_duration(extrapolated)} left")


class ClockedBar(BarColumn):
    """A bar that follows the clock until its step reports progress."""

    def render(self, task: Task):  # type: ignore[no-untyped-def]  # rich hides its type
        """Draw the bar."""
        guess = task.fields.get("guess")
        if guess:
            task.completed = min((task.elapsed or 0.0) / guess, NEARLY_DONE) * (task.total or 1.0)
        return super().render(task)


def bars() -> Progress:
    """Bars on standard error, so that standard output contains results only."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        ClockedBar(bar_width=30),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeLeft(),
        console=Console(stderr=True),
        transient=True,
        refresh_per_second=4,
    )
