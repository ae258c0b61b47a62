"""Some of many, evenly spread."""

import numpy as np


def evenly(count: int, most: int) -> list[int]:
    """At most so many of `count` places, the first and the last among them."""
    places = np.linspace(0, count - 1, min(count, most)).round().astype(int)
    return [int(place) for place in np.unique(places)]
