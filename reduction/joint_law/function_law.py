"""Joint law from a scalar Python function: derivatives by dual numbers, checked by differences.

The function is ``force(u, velocity, state, parameters)``: displacement [m], velocity [m/s], the state of the joint and
its parameters, both tuples of numbers. It returns the force [N], for a law with state ``(force, new_state)``. It is
compiled, so it may use arithmetic, comparisons, functions of `math` and functions of its file with the same limits.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, make_dataclass
from functools import cached_property
from types import FunctionType
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from jaxtyping import Float

from geometry.errors import RegistryError
from reduction.array_type import Real, Row
from reduction.joint_law.elastic_energy import compute_energy_about_mean
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples

#: Number of random instants at which derivatives are checked, fraction that may be at a kink, and largest relative
#: error.
CHECKS, AT_KINK, AGREEMENT = 60, 0.05, 1e-4
#: Step of differences relative to the size of each quantity [-], and angular frequency for the size of velocities
#: [rad/s].
STEP, OMEGA = 1e-6, 500.0


class _Disagreement(NamedTuple):
    quantity: str
    derivative: float
    difference: float


class CompiledFunction:
    """User's force function and its derivatives, compiled to machine code in this process.

    ``step(u, velocity, state, parameters, out, count)`` fills `out`, shape (3 + s + p, 1 + s): row 0 is the force and
    the new state; the next rows are their derivatives with respect to the first `count` of u, velocity, each state and
    each parameter.

    Parameters
    ----------
    force
        Force function.
    n_state, n_parameter
        Numbers of states s and of parameters p [-].
    """

    def __init__(self, force: Callable[..., Any], n_state: int, n_parameter: int) -> None:
        self.force, self.n_state, self.n_parameter = force, n_state, n_parameter

    @property
    def address(self) -> int:
        """Address of the machine code in this process."""
        return int(self._machine.address)

    @cached_property
    def _machine(self) -> Any:
        from numba import cfunc, types

        from reduction.joint_law.dual_number import dual, slope_of, value_of

        law = _machine_code(self.force, {})
        scope = {"law": law, "dual": dual, "value_of": value_of, "slope_of": slope_of}
        exec(self._source(), scope)
        pointer: Any = types.CPointer(types.float64)
        kind = types.void(types.float64, types.float64, pointer, pointer, pointer, types.int64)
        return cfunc(kind, error_model="numpy")(scope["step"])

    def _source(self) -> str:
        """Source of the step, with tuples of the right length."""
        s, p = self.n_state, self.n_parameter
        state = "".join(f"state[{i}], " for i in range(s))
        parameters = "".join(f"parameters[{i}], " for i in range(p))

        def seeded(name: str, first: int, count: int) -> str:
            return "".join(f"dual({name}[{i}], 1.0 if c == {first + i} else 0.0), " for i in range(count))

        def filled(row: str, part: str) -> list[str]:
            force = "found[0]" if s else "found"
            return [f"out[{row}] = {part}({force})"] + [
                f"out[{row} + {i + 1}] = {part}(found[1][{i}])" for i in range(s)
            ]

        return (
            "\n    ".join(
                [
                    "def step(u, velocity, state, parameters, out, count):",
                    f"found = law(u, velocity, ({state}), ({parameters}))",
                    *filled("0", "value_of"),
                    "for c in range(count):",
                    "    found = law(dual(u, 1.0 if c == 0 else 0.0), dual(velocity, 1.0 if c == 1 else 0.0), "
                    f"({seeded('state', 2, s)}), ({seeded('parameters', 2 + s, p)}))",
                    *(f"    {line}" for line in filled(f"(c + 1) * {1 + s}", "slope_of")),
                ]
            )
            .replace("found = law(dual", "moved = law(dual")
            .replace("slope_of(found", "slope_of(moved")
        )

    def __call__(
        self, u: float, velocity: float, state: Row, parameters: Row, *, derive: bool = False
    ) -> Float[Real, "c r"]:
        """Evaluate the step from Python, and return its array `out`."""
        import ctypes

        out = np.zeros((3 + self.n_state + self.n_parameter, 1 + self.n_state))
        arrays = [
            np.ascontiguousarray(state, dtype=np.float64),
            np.ascontiguousarray(parameters, dtype=np.float64),
            out,
        ]
        pointers = [item.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for item in arrays]
        self._machine.ctypes(u, velocity, *pointers, len(out) - 1 if derive else 0)
        return out


def _machine_code(function: Callable[..., Any], known: dict[Any, Any]) -> Any:
    """Compile a Python function together with the functions of its file that it calls."""
    from numba import njit

    if function not in known:
        code, scope = function.__code__, dict(function.__globals__)
        known[function] = function  # numba handles a function that calls itself
        for name in code.co_names:
            if isinstance(scope.get(name), FunctionType):
                scope[name] = _machine_code(scope[name], known)
        copied = FunctionType(code, scope, function.__name__, function.__defaults__, function.__closure__)
        known[function] = njit(error_model="numpy")(copied)
    return known[function]


class FunctionJoint(DirectedJoint):
    """Joint along one row whose force is a user's function; `joint_law` makes subclasses of it."""

    function: ClassVar[CompiledFunction]
    stuck: ClassVar[Callable[..., float]]
    energy: ClassVar[Callable[..., float] | None]

    n_slider = 0  # variables of state; set for each law

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness by the law's function of the parameters [N/m]."""
        return (float(type(self).stuck(*(getattr(self, name) for name in self.parameter_names))),)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row | None:
        """Energy by the law's function, about the mean displacement and the mean state."""
        energy, values = type(self).energy, tuple(parameters.values())
        if energy is None:
            return None
        return compute_energy_about_mean(
            lambda x: energy(x[0], tuple(x[1:]), values), np.vstack([displacement[:1], slider])
        )

    @classmethod
    def wrong(cls) -> str | None:
        """Reason why the function cannot be used, as the end of a sentence; None if it can."""
        return super().wrong() or _describe_fault(cls)


def joint_law(
    *,
    kind: str,
    parameters: Sequence[LawParameter],
    typical_displacement: float,
    n_state: int,
    stuck_stiffness: Callable[..., float],
    energy: Callable[..., float] | None,
) -> Callable[[Callable[..., Any]], type[FunctionJoint]]:
    """Decorator that makes a joint law from a function and registers it; it returns the class of the joints.

    Parameters
    ----------
    kind
        Name of the law in case files.
    parameters
        Parameters with units and bounds, in the order of the function's tuple; lists are refused.
    typical_displacement
        Displacement at which the force is nonlinear, with the typical parameters; derivatives are checked about it [m].
    n_state
        Number of state variables, which are 0 initially [-].
    stuck_stiffness
        Function with each parameter as an argument: stiffness about rest without slip [N/m].
    energy
        Function ``energy(u, state, parameters)``: energy in the springs [J]; None for a law without springs.

    Raises
    ------
    RegistryError
        A name that is already used, a parameter that is a list, a function that cannot be compiled, or derivatives that
        differ from differences.
    """

    def register(force: Callable[..., Any]) -> type[FunctionJoint]:
        given = [item for item in parameters if isinstance(item, LawParameter)]
        for what, right, wanted in (
            (f"parameters = {parameters!r}", len(given) == len(parameters), "a list of LawParameter"),
            *(
                (f'a list as its parameter "{item.name}"', not item.is_list, "each number as a parameter of its own")
                for item in given
            ),
            (f"n_state = {n_state!r}", isinstance(n_state, int) and n_state >= 0, "a whole number, 0 without memory"),
            (f"stuck_stiffness = {stuck_stiffness!r}", callable(stuck_stiffness), "a function of the parameters"),
            (f"energy = {energy!r}", energy is None or callable(energy), "a function, or None without springs"),
        ):
            if not right:
                raise RegistryError(f'the joint law "{kind}" has {what}: give {wanted}')
        law = make_dataclass(
            force.__name__,
            [
                (item.name, float) if item.default is None else (item.name, float, field(default=item.default))
                for item in given
            ],
            bases=(FunctionJoint,),
            namespace={
                "__doc__": force.__doc__ or f"The joint law {kind}.",
                "__module__": force.__module__,
                "kind": kind,
                "parameters": tuple(given),
                "typical_displacement": typical_displacement,
                "n_slider": n_state,
                "stuck": staticmethod(stuck_stiffness),
                "energy": None if energy is None else staticmethod(energy),
                "function": CompiledFunction(force, n_state, len(given)),
            },
            frozen=True,
            kw_only=True,
            eq=False,
        )
        return cast(type[FunctionJoint], LAWS.register(law, depth=2))

    return register


def _describe_fault(law: type[FunctionJoint]) -> str | None:
    """Compile the function of a law, and compare its derivatives with differences along a random motion."""
    from numba.core.errors import NumbaError

    try:
        law.function.address  # noqa: B018  # compiles
    except (NumbaError, NotImplementedError, TypeError) as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        report = next((line for line in lines if "mode pipeline" not in line and not line.startswith("- ")), "")
        n_state = law.function.n_state
        result = f"(force, new_state) with new_state a tuple of {n_state}" if n_state else "a number"
        return (
            f"has a force that cannot be compiled ({report}): use arithmetic, comparisons and functions of math, and "
            f"return {result}"
        )
    answer, count = _find_disagreements(law)
    if isinstance(answer, str):
        return answer
    if count > AT_KINK * CHECKS:
        return (
            f"has a force whose derivative by {answer.quantity} is {answer.derivative:.6g}, but by differences "
            f"{answer.difference:.6g}: a force must follow from its arguments alone and have no jumps"
        )
    return None


def _find_disagreements(law: type[FunctionJoint]) -> tuple[_Disagreement, int] | tuple[str, int]:
    """Disagreement at the last instant at which no difference agrees, and number of these instants; or a message."""
    random = np.random.default_rng(0)
    function, scale, s = law.function, law.typical_displacement, law.function.n_state
    names = ["u", "velocity", *(f"state[{i}]" for i in range(s)), *(item.name for item in law.parameters)]
    typical = np.array([item.typical for item in law.parameters])
    state, answer, count = np.zeros(s), _Disagreement("", 0.0, 0.0), 0
    for _ in range(CHECKS):
        values = typical * random.uniform(0.7, 1.3, len(typical))
        u, velocity = random.uniform(-3, 3, 2) * np.array([scale, OMEGA * scale])
        point = np.array([u, velocity, *state, *values])
        sizes = np.concatenate(
            [[scale, OMEGA * scale], np.maximum(np.abs(state), 1e-3 * scale), np.maximum(np.abs(values), 1e-300)]
        )

        def at(x: Row) -> Row:
            row: Row = function(x[0], x[1], x[2 : 2 + s], x[2 + s :])[0]
            return row

        both = function(u, velocity, state, values, derive=True)
        if not np.isfinite(both).all():
            return f"has a force or derivative that is not finite at u = {u:g} m, velocity = {velocity:g} m/s", 0
        wrong = None
        for number, (name, size) in enumerate(zip(names, sizes, strict=True)):
            shift = np.zeros_like(point)
            shift[number] = STEP * size
            low, high = at(point - shift), at(point + shift)
            slopes = np.array([(high - low) / 2, high - both[0], both[0] - low]) / shift[number]
            round_off = 1e-14 * (np.abs(both[0]) + np.abs(high - low)) / shift[number]
            error = np.abs(slopes - both[1 + number]) - round_off
            bad = (error > AGREEMENT * np.maximum(np.abs(slopes), np.abs(both[1 + number]))).all(axis=0)
            if bad.any():
                row = int(np.argmax(bad))
                wrong = _Disagreement(name, float(both[1 + number, row]), float(slopes[0, row]))
        if wrong is not None:
            answer, count = wrong, count + 1
        state = both[0, 1:].copy()
    return answer, count
