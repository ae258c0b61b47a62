"""Random oscillators in closed form: measured sweeps of linear, Duffing, Jenkins and gap systems with known branches.

The response of one mode with a nonlinear element follows from the describing function of the element: the balance at
each amplitude gives all branches without iteration. Additional linear modes cause antiresonances.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Response = NDArray[np.complex128]

#: Number of amplitudes at which the balance is evaluated, from 1e-5 of the largest possible one to the largest [-].
N_AMPLITUDE = 4000


@dataclass(frozen=True, kw_only=True)
class Oscillator:
    """Oscillator m x'' + c x' + k x + f(x) = F cos(Omega t) with additional linear modes.

    Parameters
    ----------
    kind
        "linear", "hardening", "softening", "gap" or "friction".
    frequency, damping
        Natural frequency [Hz] and damping ratio [-] of the linear part; its mass is 1 kg.
    strength
        Relative stiffness of the nonlinear element at its typical amplitude of 1 m [-].
    modes
        Frequencies [Hz] and strengths [-] of the additional linear modes.
    """

    kind: str
    frequency: float
    damping: float
    strength: float = 0.0
    modes: tuple[tuple[float, float], ...] = ()

    def element(self, amplitude: Vector) -> Response:
        """Describing function of the nonlinear element: complex stiffness at each amplitude [N/m]."""
        k, a = (2 * np.pi * self.frequency) ** 2 * self.strength, np.maximum(amplitude, 1e-12)
        if self.kind == "hardening":
            return k * a**2 + 0j
        if self.kind == "softening":
            return -k * a**2 / (1 + a**2) + 0j
        with np.errstate(invalid="ignore"):
            if self.kind == "gap":
                angle = np.arccos(np.clip(0.5 / a, 0, 1))
                return np.where(a > 0.5, k / np.pi * (angle - 0.5 / a * np.sin(angle)), 0.0) + 0j
            if self.kind == "friction":
                # Jenkins element that slips beyond 0.5 m.
                angle = np.arccos(np.clip(1 - 1.0 / a, -1, 1))
                real = k / np.pi * (angle - 0.5 * np.sin(2 * angle))
                return np.where(a > 0.5, real + 1j * k / np.pi * np.sin(angle) ** 2, k + 0j)
        return np.zeros(len(a), dtype=complex)

    def roots(self, force: float, frequency: float) -> tuple[Vector, Response]:
        """Stable amplitudes at one frequency in rising order, and their complex responses [m]."""
        omega, omega0 = 2 * np.pi * frequency, 2 * np.pi * self.frequency
        largest = 3 * force / (2 * self.damping * omega0 * min(omega, omega0)) + 1e-9
        a = np.geomspace(1e-5 * largest, largest, N_AMPLITUDE)
        stiffness = omega0**2 - omega**2 + 2j * self.damping * omega0 * omega + self.element(a)
        g = np.abs(stiffness) * a - force
        at = np.flatnonzero(np.sign(g[:-1]) != np.sign(g[1:]))
        share = g[at] / (g[at] - g[at + 1])
        stable = g[at + 1] > g[at]  # the amplitude grows with the force
        exact = a[at] * (a[at + 1] / a[at]) ** share
        exact = exact[stable]
        d = omega0**2 - omega**2 + 2j * self.damping * omega0 * omega + self.element(exact)
        return exact, force / d

    def sweep(self, force: float, frequencies: Vector, way: int) -> Response:
        """Response along a sweep up (`way` 1) or down (-1), in the order of the frequencies, shape (n,) [m]."""
        response, before = np.zeros(len(frequencies), dtype=complex), None
        for number in range(len(frequencies))[::way]:
            amplitude, value = self.roots(force, float(frequencies[number]))
            pick = 0 if before is None else int(np.argmin(np.abs(np.log(amplitude / before))))
            before, response[number] = amplitude[pick], value[pick]
        omega = 2 * np.pi * frequencies
        for at, strength in self.modes:
            other = 2 * np.pi * at
            response += strength * force / (other**2 - omega**2 + 2j * self.damping * other * omega)
        return response


def draw_oscillator(kind: str, random: np.random.Generator) -> tuple[Oscillator, float]:
    """Draw an oscillator, and a force at which its nonlinear element is visible."""
    frequency, damping = float(np.exp(random.uniform(np.log(5), np.log(500)))), float(np.exp(random.uniform(-6, -3.5)))
    strength = 0.0 if kind == "linear" else float(np.exp(random.uniform(np.log(0.02), np.log(0.5))))
    modes = tuple(
        (frequency * float(random.uniform(1.3, 4)), float(random.uniform(-1, 1))) for _ in range(random.integers(0, 3))
    )
    one = Oscillator(kind=kind, frequency=frequency, damping=damping, strength=strength, modes=modes)
    # Linear resonance amplitude, relative to the typical amplitude of 1 m.
    peak = float(np.exp(random.uniform(np.log(0.3), np.log(3))))
    omega = 2 * np.pi * frequency
    force = 2 * damping * omega**2 * peak
    if kind == "friction":
        force += strength * omega**2 * 0.5
    return one, force


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweeps:
    """Noisy sweeps of one level, with values of shape (2 sweeps, R, n), up first, and the exact values."""

    frequency: Vector
    value: Response
    exact: Response
    noise: float
    floor: float


def measure(
    one: Oscillator,
    force: float,
    random: np.random.Generator,
    *,
    n_repeat: int,
    jitter: float = 0.0,
    noise: float = 0.0,
) -> Sweeps:
    """Measure sweeps up and down over the resonance, with noise, and jitter of the frequency between sweeps."""
    n = int(random.integers(25, 120))
    backbone = [one.sweep(force, np.linspace(0.5, 2.2, 60) * one.frequency, way) for way in (1, -1)]
    peaks = [np.linspace(0.5, 2.2, 60)[int(np.argmax(np.abs(curve)))] * one.frequency for curve in backbone]
    low, high = min([*peaks, one.frequency]), max([*peaks, one.frequency])
    room = max(random.uniform(3, 20) * one.damping, 0.3 * (high / low - 1)) * one.frequency
    grid = np.linspace(low - room, high + room, n)
    exact = np.zeros((2, n_repeat, n), dtype=complex)
    for repeat in range(n_repeat):
        common = jitter * random.standard_normal()
        for number, way in enumerate((1, -1)):
            off = 1 + common + 0.3 * jitter * random.standard_normal()
            exact[number, repeat] = replace(one, frequency=one.frequency * off).sweep(force, grid, way)
    floor = 10 ** random.uniform(-1, 0) * noise * float(np.median(np.abs(exact)))
    scatter = np.hypot(noise * np.abs(exact), floor)
    value = exact + scatter * (random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape))
    return Sweeps(frequency=grid, value=value, exact=exact, noise=noise, floor=floor)
