"""A state that follows the motion by a rate equation, integrated along a straight path by the Runge-Kutta rule.

The mean over the path is that of the cubic through both ends of each part of it, with the slopes there.
"""

from fe.compiled import compiled_template

#: Smallest and largest number of parts of a step, and the length of a part over that of the knee [-].
MIN_PARTS, MAX_PARTS, CHANGE = 4, 400, 0.2


def rate(state: float, first: float, second: float) -> float:
    """Stands for the rate of a law: the derivative of its state by the path, of two numbers of the law."""
    raise NotImplementedError


@compiled_template
def follow(state: float, path: float, knee: float, first: float, second: float) -> tuple[float, float]:
    """State at the end of a path and its mean over it; all without unit.

    The rate falls from about 1 to 0, as steeply as 1 / `knee` while the state moves by 1.
    """
    parts = min(max(int(path / (CHANGE * knee)) + 1, MIN_PARTS), MAX_PARTS)
    h, total = path / parts, 0.0
    for _ in range(parts):
        a = rate(state, first, second)
        b = rate(state + 0.5 * h * a, first, second)
        c = rate(state + 0.5 * h * b, first, second)
        d = rate(state + h * c, first, second)
        after = state + h * (a + 2.0 * b + 2.0 * c + d) / 6.0
        total += 0.5 * (state + after) + h * (a - rate(after, first, second)) / 12.0
        state = after
    return state, total / parts
