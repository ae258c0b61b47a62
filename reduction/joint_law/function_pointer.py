"""Call a user's compiled function by its address, from code that was compiled before it."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _call_step(
    _context: Any, _address: Any, u: Any, velocity: Any, state: Any, parameters: Any, out: Any, count: Any
) -> Any:
    """Evaluate the function; `reduction.joint_law.function_law.CompiledFunction` describes the contiguous arrays."""

    def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        number, pointer, integer = ir.DoubleType(), ir.DoubleType().as_pointer(), ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [number, number, pointer, pointer, pointer, integer])
        numbers = [context.cast(builder, given[i], signature.args[i], types.float64) for i in (1, 2)]
        arrays = [context.make_array(signature.args[i])(context, builder, given[i]).data for i in (3, 4, 5)]
        last = context.cast(builder, given[6], signature.args[6], types.int64)
        builder.call(builder.inttoptr(given[0], kind.as_pointer()), [*numbers, *arrays, last])
        return context.get_dummy_value()

    return types.void(types.int64, u, velocity, state, parameters, out, count), build


call_step: Any = intrinsic(_call_step)
