"""Draws the effects hidden in a specimen: none, one, two, or one that the catalogue lacks, with visible strength.

nothing 22 %, one 46 %, two 12 %, stranger to the catalogue 20 %. Kinds of the catalogue have equal probability; then
the place is drawn. The strength is scaled until the signature z (`benchmarks.strangers.signature`) reaches a drawn aim
of 10 to 60, within the bounds of the effect and 30 times its typical strength; an effect that stays below 6 is drawn
again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.random_systems import log_uniform
from benchmarks.strangers.blueprint import Blueprint
from benchmarks.strangers.hidden import STRANGERS, Hidden, Known, Stranger
from benchmarks.strangers.layout import Layout
from benchmarks.strangers.response import amplitude
from benchmarks.strangers.signature import Signature
from correlation.model import Model
from diagnosis.candidate.catalogue import list_effects

CLASSES = {"nothing": 0.22, "one": 0.46, "two": 0.12, "stranger": 0.20}
#: Range of the aimed signatures, and smallest signature of a hidden effect.
AIM, LEAST = (10.0, 60.0), 6.0
#: Largest strength relative to the typical one, number of steps towards the aim, number of draws of an effect.
MOST, STEPS, DRAWS = 30.0, 6, 6


def draw_hidden(
    plan: Blueprint, layout: Layout, model: Model, signature: Signature, random: np.random.Generator
) -> list[tuple[Hidden, float]]:
    """Draw effects with their signatures; fewer than planned if no draw reaches `LEAST`."""
    chosen = str(random.choice(list(CLASSES), p=list(CLASSES.values())))
    if chosen == "nothing":
        return []
    draft = _strangers(plan, layout, model, random) if chosen == "stranger" else _known(layout, model, random)
    result: list[tuple[Hidden, float]] = []
    for _ in range(2 if chosen == "two" else 1):
        aim = float(log_uniform(random, *AIM))
        for _ in range(DRAWS):
            effect = draft()
            if effect.name in {item.name for item, _ in result}:
                continue
            scaled, z = _scaled(effect, aim, signature)
            if z >= LEAST:
                result.append((scaled, z))
                break
    return result


def _scaled(effect: Hidden, aim: float, signature: Signature) -> tuple[Hidden, float]:
    """Effect with the strength whose signature is nearest to the aim, and this signature."""
    step = effect.typical - effect.vanishes
    largest = MOST * abs(step)
    best, nearest = effect, 0.0
    weak, strong = 0.0, np.inf  # sizes of steps with signatures below and above the aim
    for _ in range(STEPS):
        # Inside the bounds, because a fit at a bound is unreliable.
        low, high = (effect.vanishes + 0.9 * (bound - effect.vanishes) for bound in effect.bounds)
        strength = float(np.clip(effect.vanishes + step, low, high))
        trial = replace(effect, strength=strength)  # type: ignore[type-var]
        z = signature.of(trial)
        if abs(np.log(max(z, 1e-9) / aim)) < abs(np.log(max(nearest, 1e-9) / aim)):
            best, nearest = trial, z
        if z and 0.8 < z / aim < 1.25:
            break
        # Zero signature: steady states were lost, or a clearance was not reached.
        grown = abs(step) * float(np.clip(aim / z, 0.1, 10.0)) if z else abs(step) / 4
        if z < aim and z:
            weak = max(weak, abs(step))
        else:
            strong = min(strong, abs(step))
        if not weak < grown < strong:
            grown = np.sqrt(weak * strong)
        step = np.copysign(min(grown, largest), step)
    return best, nearest


def _known(layout: Layout, model: Model, random: np.random.Generator) -> Callable[[], Known]:
    tested = tested_levels(layout)
    candidates = list_effects(model, level=max(tested.values()), configurations=tested).candidates
    measured = {sensor.name for sensor in layout.sensors}
    kinds: Mapping[str, Sequence[int]] = {}
    for number, effect in enumerate(candidates):
        # Delays are drawn with the strangers, because the seeds are older than this kind of the catalogue.
        if effect.kind != "delay" and (effect.kind != "gain" or effect.name.removeprefix("gain of ") in measured):
            kinds = {**kinds, effect.kind: (*kinds.get(effect.kind, ()), number)}

    def draft() -> Known:
        kind = str(random.choice(sorted(kinds)))
        effect = candidates[int(random.choice(kinds[kind]))]
        parameter, sign = effect.parameters[0], 1.0
        if parameter.vanishes or kind == "gap":
            sign = float(random.choice([-1.0, 1.0]))
        return Known(
            name=effect.name, strength=parameter.typical, vanishes=parameter.vanishes, tested=tested,
            typical=parameter.vanishes + sign * (parameter.typical - parameter.vanishes),
            bounds=(parameter.lower, parameter.upper),
        )  # fmt: skip

    return draft


def _strangers(plan: Blueprint, layout: Layout, model: Model, random: np.random.Generator) -> Callable[[], Stranger]:
    highest = tested_levels(layout)["jointed"]
    grid = layout.grids[0].frequencies

    def draft() -> Stranger:
        kind, place = str(random.choice(STRANGERS)), str(random.choice(list(plan.places)))
        motion = highest * float(amplitude(model, place, [highest], grid, free=False).max())
        # Modal stiffness of the place in the tested resonance; the modal mass follows from it.
        stiffness = highest / (motion * 2 * plan.ratio)
        if kind == "sensor delay":
            sensor = str(random.choice([item.name for item in layout.sensors]))
            return Stranger(kind=kind, place=sensor, strength=0.0, typical=0.02 / plan.stuck, known=True)
        if kind == "tuned mass":
            natural = plan.stuck * random.uniform(0.92, 1.08)
            return Stranger(
                kind=kind, place=place, strength=0.0, typical=1e-3 * stiffness / plan.stuck**2, reach=natural
            )
        power = {"quadratic": 1, "fifth order": 4}.get(kind, 0)
        reach = random.uniform(0.3, 0.7) * motion if power == 0 else 0.0
        return Stranger(kind=kind, place=place, strength=0.0, typical=0.02 * stiffness / motion**power, reach=reach)

    return draft


def tested_levels(layout: Layout) -> dict[str, float]:
    """Highest force of each configuration [N]."""
    return {
        configuration: max(max(grid.levels) for grid in layout.grids if grid.configuration == configuration)
        for configuration in dict.fromkeys(grid.configuration for grid in layout.grids)
    }
