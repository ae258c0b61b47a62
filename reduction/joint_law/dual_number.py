r"""Dual numbers for numba: a value with its derivative, to differentiate any compiled scalar function.

.. math:: f(a + \dot a\, \epsilon) = f(a) + f'(a)\, \dot a\, \epsilon, \qquad \epsilon^2 = 0

Comparisons use values only, so that the derivative is that of the executed branch. `dual`, `value_of` and `slope_of`
are for compiled code.

References
----------
Griewank and Walther, Evaluating Derivatives, SIAM (2008), chapter 3: forward mode.
"""

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.typeconv.castgraph import Conversion
from numba.extending import intrinsic, lower_cast, models, overload, register_model


class DualType(types.Type):
    """numba's type of a dual number; plain numbers are converted to it where branches meet."""

    def __init__(self) -> None:
        super().__init__(name="dual")

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        """Conversion from another type: real numbers are promoted."""
        return Conversion.promote if isinstance(other, types.Float | types.Integer | types.Boolean) else None

    def unify(self, _context: Any, other: Any) -> Any:
        """Common type of a dual number and a real number: dual."""
        return self if isinstance(other, types.Float | types.Integer | types.Boolean) else None


DUAL = DualType()


@register_model(DualType)
class _DualModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("value", types.float64), ("slope", types.float64)])  # type: ignore[no-untyped-call]


def _dual(_context: Any, value: Any, slope: Any) -> Any:
    """Dual number from a value and its derivative."""

    def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        made = cgutils.create_struct_proxy(DUAL)(context, builder)
        made.value = context.cast(builder, given[0], signature.args[0], types.float64)
        made.slope = context.cast(builder, given[1], signature.args[1], types.float64)
        return made._getvalue()

    return DUAL(value, slope), build


dual: Any = intrinsic(_dual)


def _part(name: str) -> Callable[..., Any]:
    def typed(_context: Any, _number: Any) -> Any:
        def build(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            return getattr(cgutils.create_struct_proxy(DUAL)(context, builder, value=given[0]), name)

        return types.float64(DUAL), build

    made: Callable[..., Any] = intrinsic(typed)
    return made


_value, _slope = _part("value"), _part("slope")


def value_of(number: Any) -> Any:
    """Value of a dual number, or the number itself."""


def slope_of(number: Any) -> Any:
    """Derivative of a dual number, 0 for a plain number."""


@overload(value_of, strict=False)
def _value_of(number: Any) -> Any:
    return (lambda number: _value(number)) if number == DUAL else (lambda number: float(number))


@overload(slope_of, strict=False)
def _slope_of(number: Any) -> Any:
    return (lambda number: _slope(number)) if number == DUAL else (lambda number: 0.0)  # noqa: ARG005  # numba's rule


def _cast(context: Any, builder: Any, kind: Any, _target: Any, number: Any) -> Any:
    made = cgutils.create_struct_proxy(DUAL)(context, builder)
    made.value = context.cast(builder, number, kind, types.float64)
    made.slope = context.get_constant(types.float64, 0.0)
    return made._getvalue()


for _number in (types.Float, types.Integer, types.Boolean, types.IntegerLiteral):
    lower_cast(_number, DualType)(_cast)


def _is_real(kind: Any) -> bool:
    return isinstance(kind, types.Float | types.Integer | types.Boolean)


def _two(function: Any, implementation: Callable[[Any, Any], Any]) -> None:
    """Overload a function of two arguments, of which at least one is dual."""

    @overload(function, strict=False)
    def typed(a: Any, b: Any) -> Any:
        both = all(item == DUAL or _is_real(item) for item in (a, b))
        return implementation if both and DUAL in (a, b) else None


def _one(function: Any, implementation: Callable[[Any], Any]) -> None:
    @overload(function, strict=False)
    def typed(a: Any) -> Any:
        return implementation if a == DUAL else None


def _power(a: Any, b: Any) -> Any:
    x, y, power = value_of(a), value_of(b), value_of(a) ** value_of(b)
    slope = 0.0
    if slope_of(a) != 0.0:
        slope += y * x ** (y - 1.0) * slope_of(a)
    if slope_of(b) != 0.0 and power != 0.0:
        slope += power * math.log(x) * slope_of(b)
    return dual(power, slope)


def _quotient(a: Any, b: Any) -> Any:
    ratio = value_of(a) / value_of(b)
    return dual(ratio, (slope_of(a) - ratio * slope_of(b)) / value_of(b))


def _angle(a: Any, b: Any) -> Any:
    x, y = value_of(b), value_of(a)
    return dual(math.atan2(y, x), (x * slope_of(a) - y * slope_of(b)) / (x * x + y * y))


def _hypotenuse(a: Any, b: Any) -> Any:
    size = math.hypot(value_of(a), value_of(b))
    return dual(size, (value_of(a) * slope_of(a) + value_of(b) * slope_of(b)) / size if size > 0.0 else 0.0)


def _signed(a: Any, b: Any) -> Any:
    turned = math.copysign(1.0, value_of(a)) * math.copysign(1.0, value_of(b))
    return dual(turned * value_of(a), turned * slope_of(a))


def _size(a: Any) -> Any:
    return dual(value_of(a), slope_of(a)) if value_of(a) >= 0.0 else dual(-value_of(a), -slope_of(a))


def _larger(a: Any, b: Any) -> Any:
    return dual(value_of(a), slope_of(a)) if value_of(a) >= value_of(b) else dual(value_of(b), slope_of(b))


def _smaller(a: Any, b: Any) -> Any:
    return dual(value_of(a), slope_of(a)) if value_of(a) <= value_of(b) else dual(value_of(b), slope_of(b))


_two(operator.add, lambda a, b: dual(value_of(a) + value_of(b), slope_of(a) + slope_of(b)))
_two(operator.sub, lambda a, b: dual(value_of(a) - value_of(b), slope_of(a) - slope_of(b)))
_two(operator.mul, lambda a, b: dual(value_of(a) * value_of(b), value_of(a) * slope_of(b) + slope_of(a) * value_of(b)))
_two(operator.truediv, _quotient)
_two(operator.pow, _power)
_two(operator.lt, lambda a, b: value_of(a) < value_of(b))
_two(operator.le, lambda a, b: value_of(a) <= value_of(b))
_two(operator.gt, lambda a, b: value_of(a) > value_of(b))
_two(operator.ge, lambda a, b: value_of(a) >= value_of(b))
_two(operator.eq, lambda a, b: value_of(a) == value_of(b))
_two(operator.ne, lambda a, b: value_of(a) != value_of(b))
_one(operator.neg, lambda a: dual(-value_of(a), -slope_of(a)))
_one(operator.pos, lambda a: dual(value_of(a), slope_of(a)))
_one(abs, _size)
_one(math.fabs, _size)
_one(np.abs, _size)
_two(max, _larger)
_two(np.maximum, _larger)
_two(min, _smaller)
_two(np.minimum, _smaller)
for _module in (math, np):
    _one(_module.sqrt, lambda a: dual(math.sqrt(value_of(a)), 0.5 / math.sqrt(value_of(a)) * slope_of(a)))
    _one(_module.exp, lambda a: dual(math.exp(value_of(a)), math.exp(value_of(a)) * slope_of(a)))
    _one(_module.log, lambda a: dual(math.log(value_of(a)), slope_of(a) / value_of(a)))
    _one(_module.sin, lambda a: dual(math.sin(value_of(a)), math.cos(value_of(a)) * slope_of(a)))
    _one(_module.cos, lambda a: dual(math.cos(value_of(a)), -math.sin(value_of(a)) * slope_of(a)))
    _one(_module.tan, lambda a: dual(math.tan(value_of(a)), slope_of(a) / math.cos(value_of(a)) ** 2))
    _one(_module.tanh, lambda a: dual(math.tanh(value_of(a)), slope_of(a) / math.cosh(value_of(a)) ** 2))
    _one(_module.sinh, lambda a: dual(math.sinh(value_of(a)), math.cosh(value_of(a)) * slope_of(a)))
    _one(_module.cosh, lambda a: dual(math.cosh(value_of(a)), math.sinh(value_of(a)) * slope_of(a)))
    _two(_module.hypot, _hypotenuse)
    _two(_module.copysign, _signed)
_one(math.atan, lambda a: dual(math.atan(value_of(a)), slope_of(a) / (1.0 + value_of(a) ** 2)))
_two(math.atan2, _angle)
_one(np.sign, lambda a: float(value_of(a) > 0.0) - float(value_of(a) < 0.0))
