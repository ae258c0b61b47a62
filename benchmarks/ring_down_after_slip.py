"""Errors of readings of decays that begin in gross slip, compared with their stated deviations.

    python -m benchmarks.ring_down_after_slip [--seeds FIRST:LAST] [--backbone] [--each]

Each seed is a chain of three or four masses with one or two Jenkins elements, released from a static deflection of 1 to
30 times the onset of slip, so that several modes slip at the same time and are linear afterwards. The decay is
simulated with a separate explicit integration. The truth after the last slip is the closed form of the stuck chain;
before it, with ``--backbone``, the result of harmonic balance for each mode.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.data_type.backbone import predict_backbone
from correlation.data_type.ring_down import LEAST_DAMPING, LEAST_FREQUENCY, choose_rows
from correlation.errors import CampaignError
from correlation.model import DERIVATIVE, Model, Sensor
from correlation.signal.ring_down import RingDown, analyse_ring_down
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem

Array = NDArray[np.float64]
#: First scored seed; constants were chosen with seeds from 0.
FIRST = 440_000
#: Samples per period of the first mode, and steps of the integration per sample.
SAMPLES, SUBSTEPS = 40, 12
#: Error of a wrong reading [standard deviations].
WRONG = 3.0
#: Relative standard deviations of frequency and damping above which a reading is vague [-].
VAGUE = (0.01, 0.5)


@dataclass(frozen=True, kw_only=True, eq=False)
class SlippingChain:
    """Chain with its release and sensor; directions of contacts are rows, shape (c, n)."""

    mass: Array
    damping: Array
    stiffness: Array
    directions: Array
    tangential: Array
    limit: Array
    deflection: Array
    frequency: Array
    damping_ratio: Array
    sensor: int
    quantity: str
    noise: float

    @classmethod
    def draw(cls, random: np.random.Generator) -> "SlippingChain":
        n, n_contact = int(random.integers(3, 5)), int(random.integers(1, 3))
        mass = np.diag(random.uniform(0.7, 2.0, n))
        spring = 1e6 * random.uniform(0.6, 1.8, n)
        difference = np.eye(n) - np.eye(n, k=-1)
        stiffness = difference.T @ (spring[:, None] * difference)
        directions = np.zeros((n_contact, n))
        for row in directions:
            first, second = random.permutation(n)[:2]
            row[first] = 1.0
            if random.uniform() < 0.5:
                row[second] = -1.0
        tangential = 1e6 * random.uniform(0.1, 0.7, n_contact)
        limit = random.uniform(3.0, 15.0, n_contact)
        stuck = stiffness + directions.T @ (tangential[:, None] * directions)
        square, shapes = eigh(stuck, mass)
        omega, ratio = np.sqrt(square), random.uniform(0.002, 0.008, n)
        damping = mass @ shapes @ np.diag(2 * ratio * omega) @ shapes.T @ mass
        deflection = np.linalg.solve(stuck, random.standard_normal(n))
        onset = (np.abs(tangential * (directions @ deflection)) / limit).max()
        return cls(
            mass=mass, damping=damping, stiffness=stiffness, directions=directions, tangential=tangential, limit=limit,
            deflection=deflection / onset * 30 ** random.uniform(0, 1), frequency=omega / (2 * np.pi),
            damping_ratio=ratio, sensor=int(random.integers(n)),
            quantity=str(random.choice(["displacement", "velocity", "acceleration"])),
            noise=10 ** random.uniform(-3, -2),
        )  # fmt: skip

    def decay(self) -> tuple[Array, Array, float]:
        """Simulate the decay; returns times [s], signal of the sensor without noise, and time of the last slip [s]."""
        duration = min(4.0 / (self.damping_ratio[0] * 2 * np.pi * self.frequency[0]), 3.0)
        step = 1 / (SAMPLES * self.frequency[0])
        n = int(duration / step)
        signal, last = integrate_chain(
            np.diag(self.mass).copy(), self.damping, self.stiffness, self.directions, self.tangential, self.limit,
            self.deflection, n, SUBSTEPS, step / SUBSTEPS, self.sensor, DERIVATIVE[self.quantity],
        )  # fmt: skip
        return step * np.arange(n), signal, step * last

    def model(self) -> Model:
        """Model of the chain for harmonic balance."""
        system = JointedSystem(
            mass=self.mass, damping=self.damping, stiffness=self.stiffness,
            joints=[
                JenkinsElement(
                    name=f"contact {number}", direction=row, tangential_stiffness=float(kt), limit_force=float(limit)
                )
                for number, (row, kt, limit) in enumerate(
                    zip(self.directions, self.tangential, self.limit, strict=True)
                )
            ],
        )  # fmt: skip
        row = np.eye(len(self.mass))[self.sensor]
        return Model(system=system, sensors=(Sensor(name="s", row=row, quantity=self.quantity),))


@numba.njit  # type: ignore[untyped-decorator]
def integrate_chain(mass, damping, stiffness, directions, tangential, limit, x, n, substeps, step, sensor, derivative):  # type: ignore[no-untyped-def]
    """Samples of one coordinate or its derivative, and number of the last sample in which a contact slips.

    Velocity Verlet with damping from the predicted velocity; sliders by return mapping.
    """
    x = x.copy()
    v = np.zeros(len(x))
    slider = np.zeros(len(tangential))
    signal = np.zeros(n)
    last = 0
    acceleration = np.zeros(len(x))
    for sample in range(n):
        for substep in range(substeps):
            half = v + 0.5 * step * acceleration
            if sample + substep > 0:
                x = x + step * half
            force = -stiffness @ x
            for c in range(len(tangential)):
                u = directions[c] @ x
                tangent = tangential[c] * (u - slider[c])
                friction = min(max(tangent, -limit[c]), limit[c])
                if friction != tangent:
                    slider[c] = u - friction / tangential[c]
                    last = sample
                force -= friction * directions[c]
            acceleration = (force - damping @ (half + 0.5 * step * acceleration)) / mass
            if sample + substep > 0:
                v = half + 0.5 * step * acceleration
            if substep == 0:
                motion = x if derivative == 0 else v if derivative == 1 else acceleration
                signal[sample] = motion[sensor]
    return signal, last


def score_readings(chain: SlippingChain, modes: Sequence[RingDown], last: float, backbone: bool) -> Array:
    """Errors of compared readings relative to their stated deviations, shape (m, 5).

    Columns are the errors of frequency and damping in deviations, the two relative deviations, and whether the chain
    still slips afterwards.
    """
    result = []
    for mode in modes:
        rows = choose_rows(mode)
        number = int(np.argmin(np.abs(chain.frequency - mode.frequency[-1])))
        truth = np.tile([chain.frequency[number], chain.damping_ratio[number]], (len(rows), 1))
        slips = mode.time[rows] < last
        if slips.any():
            truth[slips] = np.nan
            if backbone:
                near, at = float(chain.frequency[number]), mode.amplitude[rows][slips]
                truth[slips] = np.column_stack(predict_backbone(chain.model(), "s", near, at))
        values = np.column_stack([mode.frequency[rows], mode.damping_ratio[rows]])
        sizes = np.column_stack([mode.frequency_deviation[rows], mode.damping_deviation[rows]])
        sizes = np.hypot(sizes, np.abs(values) * [LEAST_FREQUENCY, LEAST_DAMPING])
        result.append(np.column_stack([(values - truth) / sizes, sizes / np.abs(truth), slips]))
    return np.concatenate(result) if result else np.zeros((0, 5))


def main() -> None:
    words = sys.argv[1:]
    chosen = words[words.index("--seeds") + 1] if "--seeds" in words else f"{FIRST}:{FIRST + 60}"
    first, end = map(int, chosen.split(":"))
    scores, refused, empty, spent = [], 0, 0, 0.0
    for seed in range(first, end):
        random = np.random.default_rng(seed)
        chain = SlippingChain.draw(random)
        at, clean, last = chain.decay()
        noisy = clean + chain.noise * np.abs(clean).max() * random.standard_normal(len(clean))
        started = time.process_time()
        try:
            modes = analyse_ring_down(at, noisy, quantity=chain.quantity)
        except CampaignError:
            modes, refused = (), refused + 1
        spent += time.process_time() - started
        own = score_readings(chain, modes, last, "--backbone" in words)
        empty += not len(own)
        scores.append(own)
        if "--each" in words:
            wrong = (np.abs(own[:, :2]) > WRONG).sum(axis=0)
            began = f"{modes[0].start:.3f}" if modes else "-"
            largest = np.nanmax(np.abs(own[:, :2]), axis=0, initial=0).round(1)
            print(
                f"{seed}: {len(modes)} modes, last slip {last:.3f} s of {at[-1]:.2f}, begins {began} s, "
                f"wrong {wrong} of {len(own)}; largest {largest}, {time.process_time() - started:.1f} s",
                flush=True,
            )
    every = np.concatenate(scores)
    for words_of, mask in (("after the last slip", every[:, 4] == 0), ("before it", every[:, 4] == 1)):
        own = every[mask & np.isfinite(every[:, 0])]
        if not len(own):
            continue
        wrong = (np.abs(own[:, :2]) > WRONG).sum(axis=0)
        vague = ((own[:, 2] > VAGUE[0]) | (own[:, 3] > VAGUE[1])).sum()
        print(
            f"{words_of}: of {len(own)} readings frequency is off in {wrong[0]}, damping in {wrong[1]}; "
            f"vague {vague}; median deviations {np.median(own[:, 2]):.1e}, {np.median(own[:, 3]):.1e}"
        )
    bad = sum(bool((np.abs(own[:, :2]) > 5).any()) for own in scores)
    print(
        f"decays with a reading beyond 5 deviations {bad}, refused {refused}, without readings {empty} of {end - first}"
    )
    print(f"{spent:.0f} s of processor time")


if __name__ == "__main__":
    main()
