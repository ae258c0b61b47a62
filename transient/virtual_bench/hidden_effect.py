"""The virtual test bench: a campaign of measurements on a beam with one hidden effect, and the truth separately.

The bench has its own model of the beam, integrates it in time and writes its files itself; it shares no model, solver
or reader with what is tested on its data.
"""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from transient.errors import TransientError
from transient.virtual_bench.beam import BeamParameters, random_stations, reduced_beam
from transient.virtual_bench.campaign import CampaignPoints, random_parameters, sweeps, with_noise, write_campaign
from transient.virtual_bench.effect import KINDS, NOTHING, SIGNED, UNITS, HiddenEffect

STRENGTHS = Path(__file__).with_name("strength.toml")
#: Strengths are drawn between 1 and so many times the unit strength.
STRONGEST = 4.0


@dataclass(frozen=True, kw_only=True)
class HiddenEffectRecord:
    """Hidden effect and true parameters of a campaign, and statistics of its simulation."""

    seed: int
    """Of everything random."""
    effect: HiddenEffect
    """What is hidden."""
    unit: str
    """Of its strength."""
    unit_strength: float
    """Strength at which the effect moves the noise-free features by 5 standard deviations; 0 for nothing."""
    parameters: BeamParameters
    """Of the specimen, without the effect and without jitter."""
    stations: tuple[float, ...]
    """Of its contacts [m]."""
    n_point: int
    n_not_periodic: int
    """Points measured, and those where the motion had not come to repeat [-]."""
    n_period: int
    """Periods integrated [-]."""
    slip_share: dict[float, float]
    """Largest share of slip along the sweeps of each level, mean over the repeats [-]."""

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        Path(path).write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")


def read_unit_strengths() -> dict[str, dict[str, float]]:
    """Unit strength by kind and place, in SI units, as `benchmarks.unit_strengths` finds them."""
    import tomllib

    table = tomllib.loads(STRENGTHS.read_text(encoding="utf-8"))
    return {kind: dict(places) for kind, places in table["unit_strength"].items()}


def random_effect(
    random: np.random.Generator, kind: str | None = None, place: str | None = None, strength: float | None = None
) -> HiddenEffect:
    """An effect, with what is not given drawn: kinds and places alike often, strength log-uniform in 1 to 4 units."""
    # As many numbers whatever is given, so that a seed always means the same.
    which, where, size, sign = random.uniform(size=4)
    kind = [*KINDS][int(which * len(KINDS))] if kind is None else kind
    if kind == NOTHING:
        return HiddenEffect(kind=NOTHING)
    if kind not in KINDS:
        raise TransientError(f'the effect "{kind}" is not one of {", ".join([*KINDS, NOTHING])}')
    place = KINDS[kind][int(where * len(KINDS[kind]))] if place is None else place
    if strength is None:
        strength = read_unit_strengths()[kind][place] * float(STRONGEST**size)
        if kind in SIGNED and sign < 0.5:
            strength = -strength
    return HiddenEffect(kind=kind, place=place, strength=float(strength))


def make_campaign(
    folder: Path | str,
    *,
    seed: int,
    kind: str | None = None,
    place: str | None = None,
    strength: float | None = None,
    points: CampaignPoints | None = None,
) -> HiddenEffectRecord:
    """Measure a specimen with a hidden effect and write the campaign folder; the truth is returned, not written.

    Parameters
    ----------
    folder
        Where campaign.toml and its tables go.
    seed
        Of specimen, effect, histories, jitter and noise; the same seed gives the same bytes.
    kind
        A key of `transient.virtual_bench.effect.KINDS`, or "nothing"; drawn by default.
    place, strength
        Where, and how strong in the unit of `UNITS`; drawn by default.
    points
        Where to measure; 4 levels, 24 frequencies and 5 repeats by default.

    Raises
    ------
    TransientError
        An unknown kind or place.
    """
    points = points or CampaignPoints()
    # Streams of their own: a specimen of a seed has the same histories and noise whatever is hidden in it.
    streams = [np.random.default_rng(item) for item in np.random.SeedSequence(seed).spawn(5)]
    effect = random_effect(streams[0], kind, place, strength)
    parameters = random_parameters(streams[1])
    stations = random_stations(streams[4])
    clean = list(sweeps(reduced_beam(stations=stations), parameters, effect, points, streams[2]))
    measured = [replace(sweep, readings=with_noise(sweep.readings, streams[3])) for sweep in clean]
    write_campaign(Path(folder), measured, points)
    periodic = np.concatenate([sweep.readings.periodic for sweep in clean])
    return HiddenEffectRecord(
        seed=seed,
        effect=effect,
        unit=UNITS[effect.kind],
        unit_strength=0.0 if effect.kind == NOTHING else read_unit_strengths()[effect.kind][effect.place],
        parameters=parameters,
        stations=stations,
        n_point=len(periodic),
        n_not_periodic=int((~periodic).sum()),
        n_period=int(sum(sweep.readings.n_period.sum() for sweep in clean)),
        slip_share={
            float(level): float(
                np.mean(
                    [
                        sweep.readings.slip_share.max()
                        for sweep in clean
                        if sweep.level == level and sweep.configuration == "jointed"
                    ]
                )
            )
            for level in points.levels
        },
    )
