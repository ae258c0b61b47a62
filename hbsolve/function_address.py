"""Calls of a compiled function by its address, so that its callers do not contain its machine code.

numba compiles a function together with all functions that it calls. If several callers choose among many functions,
each would contain a copy of every one, and compiling takes several times as long. A function that is called by its
address is compiled once, and only if it is used.
"""

from collections.abc import Callable, Sequence
from typing import Any

from numba import typeof, types
from numba.core import cgutils
from numba.core.typing.templates import Signature
from numba.extending import intrinsic


def find_function_address(function: Callable[..., Any], arguments: Sequence[Any]) -> int:
    """Address in this process of the machine code of a compiled function that returns nothing; compiled on first use.

    Parameters
    ----------
    function
        Function decorated by `fe.compiled.compiled`.
    arguments
        Examples of its arguments: only their types are used.

    Raises
    ------
    TypeError
        The function returns something.
    """
    machine: Any = function
    kinds = tuple(typeof(argument) for argument in arguments)
    machine.compile(kinds)
    result = machine.overloads[kinds]
    if result.signature.return_type != types.none:
        raise TypeError(f"{function.__name__} returns {result.signature.return_type}: it must return nothing")
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def caller(arguments: Sequence[Any]) -> Any:
    """Function that compiled code calls as ``call(address, (u, v, ...))``, with arguments of the types of `arguments`.

    Arguments of other types are an error of numba when the caller is compiled, since the code at the address is
    compiled for these types only.
    """
    expected = types.Tuple(tuple(typeof(argument) for argument in arguments))

    def call(_context: Any, _address: Any, given: Any) -> tuple[Signature, Callable[..., Any]] | None:
        if given != expected:
            return None

        def build(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            convention = context.call_conv
            kind = convention.get_function_type(types.none, expected.types)
            code = builder.inttoptr(values[0], kind.as_pointer())
            parts = cgutils.unpack_tuple(builder, values[1])
            status, _ = convention.call_function(builder, code, types.none, expected.types, parts)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return context.get_dummy_value()

        return types.none(types.int64, given), build

    return intrinsic(call)
