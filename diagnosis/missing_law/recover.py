r"""Recovery of a missing law: to first order at every place, then with new solutions of the balance at the best ones.

The force at a place is a prescribed load of the model in each state. About the states with the loads F of the previous
estimate, the measurements satisfy

.. math:: y - x(F, \theta) + H F = H f + J\, d\theta + e, \qquad f = \sum_i c_i F_i ,

with H the derivatives of the readings with respect to forces at the place (contacts linearised), J those with respect
to the calibration parameters, with the rows of their priors below, which are projected out, and F_i the harmonics of
function i from alternating frequency and time. The functions are evaluated along the *measured* motion of the place.
Without a sensor at the place, the motion follows from the force G that explains the readings best and the receptance
alpha of the place,

.. math:: u = u(F, \theta) + \alpha \arg\min_G |S^{-1/2} (y - x(F, \theta) - H G)|^2 ,

so that a wrong law cannot cause branches through its effect on the motion. On a linear structure one step is exact for
a force of any size. `diagnosis.missing_law.evidence` gives coefficients, their sizes and the scatter; the resulting
forces are the loads of the next step.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from correlation.model import Model, Sensor
from correlation.prediction import Key, Prediction, Predictor
from diagnosis.candidate.place import choose_units, is_parallel
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.fit_parameter import Values
from diagnosis.fit.refit import is_poor_fit
from diagnosis.fit.tangent import differentiate
from diagnosis.fit.weighting import leave_out_model_error
from diagnosis.missing_law.basis import EVEN, LawBasis, find_harmonics, follow
from diagnosis.missing_law.evidence import Posterior, compute_null_cost, compute_posterior
from diagnosis.missing_law.law_joints import list_law_joints
from diagnosis.missing_law.loaded_states import Response, StateTable, compute_loaded_response, compute_response
from diagnosis.missing_law.place_law import MissingLaw, Motion, PlaceLaw, Row, rank_laws
from diagnosis.missing_law.place_motion import find_motion
from diagnosis.screening import make_basis, project_out
from hbsolve.errors import ModelError, NoSteadyState
from hbsolve.state import SteadyState
from reduction.jointed_system import Joint

#: Number of harmonics of a missing force, the mean first [-].
N_HARMONIC = 6
#: Largest number of places whose states are solved again, and number of such solutions.
REFINED, ROUNDS = 4, 2
#: Largest number of estimates of the scatter.
WEIGHINGS = 6
#: Relative change of the scatter that ends its estimation [-].
SETTLED = 0.01
#: Iterations with the law in the model, shares of a step that are tried, and the least significant fall of chi-squared.
CLOSED_ROUNDS, SHARES, ENOUGH = 8, (1.0, 0.5, 0.25, 0.1), 1.0
#: Least evidence of a law: odds of 20 to 1.
MIN_EVIDENCE = float(np.log(20))


def recover_law(arrangement: Arrangement, rows: Mapping[str, Row] | None = None) -> MissingLaw | None:
    """Recover the law of a missing force.

    Parameters
    ----------
    arrangement
        Measurements and calibrated model.
    rows
        Places where the force may act, rows over the degrees of freedom by name, shape (r,) each [-]; by default the
        places of the model and of its sensors.

    Returns
    -------
    The law at each place; None if nothing moves, or the odds of the best law are less than 20 to 1.
    """
    rows = list_places(arrangement) if rows is None else {name: row for name, row in rows.items() if row.any()}
    if not rows:
        return None
    recovery = _Recovery.begin(_without_model_error(arrangement), rows)
    laws = [law for number in range(len(rows)) if (law := recovery.compute_first_order_law(number)) is not None]
    laws.sort(key=lambda law: -law.evidence)
    if not laws or laws[0].evidence < MIN_EVIDENCE:
        return None
    refined = [recovery.refine(law) for law in laws[:REFINED]]
    return rank_laws([*refined, *laws[REFINED:]])


def _without_model_error(arrangement: Arrangement) -> Arrangement:
    """The same without model error, since the estimated model error may be the missing law."""
    if arrangement.train.model_error is None:
        return arrangement
    of, fit, m = arrangement.train, arrangement.fit, arrangement.fit.n_number
    train = leave_out_model_error(of)
    jacobian = np.concatenate([train.whitening(of.whitening.unwhiten(fit.jacobian[:m])), fit.jacobian[m:]])
    residual = np.concatenate([train.residual(fit.prediction), fit.residual[m:]])
    fit = replace(fit, jacobian=jacobian, residual=residual, chi2=float(residual @ residual))
    return replace(arrangement, train=train, fit=fit)


def list_places(arrangement: Arrangement) -> dict[str, Row]:
    """Places of the model and of its sensors, by name; only one of places with parallel rows."""
    model = arrangement.fit.model
    rows: dict[str, Row] = {}
    named = [*model.places.items(), *((item.name, item.row) for item in model.sensors if isinstance(item, Sensor))]
    for name, row in named:
        if row.any() and not any(is_parallel(row, other) for other in rows.values()):
            rows[name] = row
    return rows


def _with_directions(state: SteadyState, joints: Sequence[Joint]) -> SteadyState:
    """A state with the displacements of additional joints, computed from the motion of the structure."""
    rows = np.concatenate([joint.directions for joint in joints])
    moved = state.coefficients[: len(state.displacement)] @ rows.T
    return replace(state, displacement=np.hstack([state.displacement, moved]))


@dataclass(frozen=True, kw_only=True, eq=False)
class _ClosedLaw:
    """A law as joints of the model: calibration parameters, coefficients of the law, model and prediction."""

    values: Values
    mean: NDArray[np.float64]
    model: Model
    predictor: Predictor
    prediction: Prediction


@dataclass(frozen=True, kw_only=True, eq=False)
class _Recovery:
    """The model without a law, and its response to forces at each place."""

    arrangement: Arrangement
    rows: Mapping[str, Row]
    values: Values
    table: StateTable
    response: Response
    has_tangent: Bool[NDArray[np.bool_], " p"]
    """Mask of the parameters with a tangent; a parameter that moves points of the model has none and is not fitted."""
    cost: float

    @classmethod
    def begin(cls, arrangement: Arrangement, rows: Mapping[str, Row]) -> "_Recovery":
        train, fit, unknowns = arrangement.train, arrangement.fit, arrangement.unknowns([])
        # A poor fit without the law may be further from the truth than the model before calibration.
        values = unknowns.vanishing if is_poor_fit(arrangement) else fit.values
        model = unknowns.compose(values)
        prediction = train.predict(model, fit.prediction) if values is not fit.values else fit.prediction
        table = StateTable.from_points(train.features.points, prediction.states)
        changes = differentiate(unknowns.compose, values, unknowns.size, unknowns.bounds)
        tangents = [item for item in changes if item]
        count = min(N_HARMONIC, model.n_harmonic)
        response = compute_response(train.predictor, model, prediction, table, list(rows.values()), count, tangents)
        m = fit.n_number
        noise = max(1.0, float(np.sqrt(np.mean(fit.residual[:m] ** 2))))
        scale = np.concatenate([np.full(m, 1 / noise), np.ones(len(values))])
        taken = make_basis(fit.jacobian * unknowns.size * scale[:, None])
        cost = compute_null_cost(project_out(taken, scale * fit.residual), m, 1 / noise) + m * np.log(noise**2)
        return cls(
            arrangement=arrangement, rows=rows, values=values, table=table, response=response, cost=cost,
            has_tangent=np.array([item is not None for item in changes], dtype=np.bool_),
        )  # fmt: skip

    def compute_first_order_law(self, number: int) -> PlaceLaw | None:
        """The law at a place, linearised about the states without it; None for a place that does not move."""
        name, row = list(self.rows.items())[number]
        response = replace(
            self.response, motion=self.response.motion[:, [number]], slopes=self.response.slopes[:, [number]],
            receptance=self.response.receptance[:, [number]],
        )  # fmt: skip
        return self._infer(name, row, self.values, np.zeros_like(response.motion[:, 0]), response)

    def refine(self, law: PlaceLaw) -> PlaceLaw:
        """The law linearised about states with the measured motion, then fitted as joints of the model."""
        laws, states = [law], self.response.states
        for _ in range(ROUNDS):
            here = laws[-1]
            response = self._solve(here.row, here.values, here.drive, states)
            if response is None:
                break
            states = {**states, **response.states}
            there = self._infer(here.name, here.row, here.values, here.drive, response, here.posterior.noise)
            if there is None:
                break
            laws.append(there)
        return self._close(laws, states)

    def _close(self, laws: Sequence[PlaceLaw], states: Mapping[Key, SteadyState]) -> PlaceLaw:
        """The law fitted as joints of the model, started from the estimate with the lowest misfit.

        Starts are the estimates and shares of them. If a fit is worse than the best estimate, the next start is tried.
        """
        starts: list[tuple[float, int, _ClosedLaw]] = []
        for number, law in enumerate(laws):
            for share in SHARES:
                values, mean = self.values + share * (law.values - self.values), share * law.posterior.mean
                closed = self._predict_with_law(law, values, mean, states)
                if closed is not None:
                    starts.append((self._misfit(closed, 1.0), number, closed))
        best, tried = max(laws, key=lambda item: item.evidence), set[int]()
        for _, number, closed in sorted(starts, key=lambda item: item[:2]):
            if number in tried:
                continue
            tried.add(number)
            result = self._descend(laws[number], closed, states)
            if result.evidence > best.evidence:
                return result
        return best

    def _descend(self, law: PlaceLaw, closed: _ClosedLaw, states: Mapping[Key, SteadyState]) -> PlaceLaw:
        """Damped Gauss-Newton steps: each is shortened until the misfit falls."""
        noise = np.sqrt(max(1.0, float(np.mean(self.arrangement.train.residual_of(closed.prediction.value) ** 2))))
        here, known = replace(law, posterior=replace(law.posterior, noise=float(noise))), dict(states)
        for _ in range(CLOSED_ROUNDS):
            try:
                response = self._linearise(here, closed)
            except ModelError:
                break
            known |= response.states
            here = self._posterior_about_law(here, closed.values, closed.mean, response)
            misfit, after, moved = self._misfit(closed, here.posterior.noise), np.inf, None
            for share in SHARES:
                values = closed.values + share * (here.values - closed.values)
                mean = closed.mean + share * (here.posterior.mean - closed.mean)
                moved = self._predict_with_law(here, values, mean, known)
                after = np.inf if moved is None else self._misfit(moved, here.posterior.noise)
                if after < misfit:
                    break
            if moved is None or misfit - after < ENOUGH:
                break
            closed = moved
        return here

    def _predict_with_law(
        self, law: PlaceLaw, values: Values, mean: NDArray[np.float64], states: Mapping[Key, SteadyState]
    ) -> _ClosedLaw | None:
        """Prediction with the law in the model, starting from given states; None if a state is missing."""
        model = self.arrangement.unknowns([]).compose(values)
        own = list_law_joints(f"law at {law.name}", law.row, law.basis, mean)
        model = model.with_system(joints=[*model.system.joints, *own])
        # If the model without the law has a state at every point, a law without one is rejected at once.
        has_all = bool((self.table.number >= 0).all())
        predictor = Predictor(points=self.arrangement.train.features.points, needs_all=has_all)
        guesses = {key: _with_directions(state, own) for key, state in states.items()}
        nearby = Prediction(points=predictor.points, value=np.zeros(0, dtype=complex), states=guesses)
        try:
            prediction = predictor.predict(model, nearby)
        except (ModelError, NoSteadyState):
            return None
        if any(key not in prediction.states for key in self.table.keys):
            return None
        return _ClosedLaw(values=values, mean=mean, model=model, predictor=predictor, prediction=prediction)

    def _linearise(self, law: PlaceLaw, closed: _ClosedLaw) -> Response:
        """Response linearised about the states with the law, which takes several times as long as solving for them."""
        unknowns = self.arrangement.unknowns([])
        changes = differentiate(unknowns.compose, closed.values, unknowns.size, unknowns.bounds)
        return compute_response(
            closed.predictor, closed.model, closed.prediction, self.table, [law.row], law.motion.shape[1],
            [item for item in changes if item],
        )  # fmt: skip

    def _posterior_about_law(
        self, law: PlaceLaw, values: Values, mean: NDArray[np.float64], response: Response
    ) -> PlaceLaw:
        """The law linearised about states of the model with the law, along the motion of the model."""
        train, unknowns, motion = self.arrangement.train, self.arrangement.unknowns([]), response.motion[:, 0]
        forces = self._list_forces(law.basis, motion)
        loads = -forces @ mean
        listed = np.concatenate([loads[..., None], -forces], axis=2)
        changed = self._whiten(response, self._read(response, listed), is_force=False)
        others = self._whiten(response, response.tangents, is_force=False)
        columns = np.zeros((len(changed), len(values)))
        columns[:, self.has_tangent] = others
        data = train.residual_of(response.value) + changed[:, 0]
        posterior, step = self._explain(
            data, changed[:, 1:], columns, values, law.basis, forces[:, 1], law.posterior.noise
        )
        return replace(
            law, posterior=posterior, motion=motion, loads=-forces @ posterior.mean,
            values=unknowns.clipped(values + step), evidence=(self.cost - posterior.cost) / 2,
        )  # fmt: skip

    def _list_forces(self, basis: LawBasis, motion: Motion) -> Complex[NDArray[np.complex128], "s h b"]:
        """Harmonics of the force of each function along the motion; even functions are zero if not measurable."""
        forces = find_harmonics(basis.forces(*follow(motion, self.table.angular_frequency)), motion.shape[1])
        if not self._sees_even():
            forces[..., basis.group == EVEN] = 0.0
        return forces

    def _misfit(self, closed: _ClosedLaw, noise: float) -> float:
        """-2 ln of the density of data and calibration parameters, up to a constant [-]."""
        data, away = self.arrangement.train.residual_of(closed.prediction.value), self._away(closed.values)
        return float(data @ data) / noise**2 + float(away @ away)

    def _solve(self, row: Row, values: Values, loads: Motion, states: Mapping[Key, SteadyState]) -> Response | None:
        unknowns = self.arrangement.unknowns([])
        changes = differentiate(unknowns.compose, values, unknowns.size, unknowns.bounds)
        try:
            return compute_loaded_response(
                self.arrangement.train.predictor, unknowns.compose(values), states, self.table, row, loads,
                [item for item in changes if item],
            )  # fmt: skip
        except ModelError:
            return None

    def _away(self, values: Values) -> Values:
        unknowns = self.arrangement.unknowns([])
        centre = unknowns.vanishing if unknowns.centre is None else unknowns.centre
        return np.asarray((centre - values) / unknowns.prior)

    def _infer(
        self, name: str, row: Row, values: Values, loads: Motion, response: Response, noise: float | None = None
    ) -> PlaceLaw | None:
        """The law linearised about states with loads."""
        train, unknowns = self.arrangement.train, self.arrangement.unknowns([])
        motion, missing = find_motion(train, self.table, self.arrangement.fit.model, row, response)
        u, v = follow(motion, self.table.angular_frequency)
        if not u.any() or not v.any():
            return None
        basis = LawBasis(reach=float(np.abs(u).max()), speed=float(np.abs(v).max()))
        forces = self._list_forces(basis, motion)
        listed = np.concatenate([loads[..., None], -forces], axis=2)
        changed = self._whiten(response, self._read(response, listed), is_force=True)
        carried, law = changed[:, 0], changed[:, 1:]
        others = self._whiten(response, response.tangents, is_force=False)
        columns = np.zeros((len(law), len(values)))
        columns[:, self.has_tangent] = others
        data = train.residual_of(response.value) + carried
        posterior, step = self._explain(data, law, columns, values, basis, forces[:, 1], noise)
        own = -forces @ posterior.mean
        drive = own.copy()
        if missing.any():
            drive[:, 1] = loads[:, 1] + missing
        return PlaceLaw(
            name=name, row=row, basis=basis, units=choose_units(self.arrangement.fit.model, row), posterior=posterior,
            motion=motion, table=self.table, loads=own, drive=drive,
            values=unknowns.clipped(values + step), evidence=(self.cost - posterior.cost) / 2,
        )  # fmt: skip

    def _explain(
        self, data: NDArray[np.float64], law: NDArray[np.float64], others: NDArray[np.float64], values: Values,
        basis: LawBasis, fundamental: Motion, noise: float | None,
    ) -> tuple[Posterior, Values]:  # fmt: skip
        """Posterior of the coefficients of a law, and the step of the calibration parameters.

        The scatter scales the data alone, so that the priors of the parameters keep their weight.
        """
        unknowns, n = self.arrangement.unknowns([]), len(data)
        noise = max(1.0, float(np.sqrt(np.mean(data**2)))) if noise is None else noise
        prior, away = np.diag(1 / unknowns.prior), self._away(values)
        for _ in range(WEIGHINGS):
            jacobian = np.vstack([others / noise, prior]) * unknowns.size
            target = np.concatenate([data / noise, away])
            changes = np.vstack([law / noise, np.zeros((len(values), law.shape[1]))])
            taken = make_basis(jacobian)
            result = compute_posterior(
                project_out(taken, changes), project_out(taken, target), basis.group, basis.is_positive,
                fundamental, n, 1 / noise,
            )  # fmt: skip
            result = replace(result, cost=result.cost + n * np.log(noise**2), noise=noise * result.noise)
            settled, noise = abs(np.log(result.noise / noise)) < SETTLED, result.noise
            if settled:
                break
        step, *_ = np.linalg.lstsq(jacobian, target - changes @ result.mean, rcond=1e-12)
        return result, step * unknowns.size

    def _sees_even(self) -> bool:
        """Whether an even harmonic was measured; without one, an even force is visible to second order at most."""
        return bool((self.arrangement.train.features.points.harmonic % 2 == 0).any())

    def _read(
        self, response: Response, forces: Complex[NDArray[np.complex128], "s h b"]
    ) -> Complex[NDArray[np.complex128], "k b"]:
        """Change of each reading by harmonics of forces at the place, shape (k, b)."""
        at = forces[self.table.number]
        slopes = np.where((self.table.number >= 0)[:, None, None], response.slopes[:, 0], 0.0)
        change = np.einsum("kh,khb->kb", slopes[..., 0], at.real) + np.einsum("kh,khb->kb", slopes[..., 1], at.imag)
        return np.asarray(change)

    def _whiten(
        self, response: Response, changes: Complex[NDArray[np.complex128], "k b"], *, is_force: bool
    ) -> Float[NDArray[np.float64], "m b"]:
        """Whitened changes of the features.

        With x the reading of the model and y the measured one, F / X changes by -dx / (x y) F with a force and by
        -dx / x^2 F with a stiffness, exactly if one spring changes. The same is true for ratios to X.
        """
        train, features = self.arrangement.train, self.arrangement.train.features
        if is_force:
            measured = np.where(train.observed.phased, train.observed.value, response.value)
            with np.errstate(invalid="ignore", divide="ignore"):
                factor = response.value / measured
            factor = np.where(np.isfinite(factor), factor, 1.0)
            own = features.fundamental | (features.reference >= 0)
            to = np.where(features.reference >= 0, features.reference, np.arange(len(factor)))
            changes = changes * np.where(own, factor[to], 1.0)[:, None]
        slopes = features.slopes(response.value, changes)
        return train.whitening(np.where(np.isfinite(slopes), slopes, 0.0))
