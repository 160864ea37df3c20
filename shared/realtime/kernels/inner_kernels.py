"""Kernels that only kernels call are compiled without numba's wrapper for calls from Python, until Python calls one.

Such a wrapper takes each argument out of Python objects, and a servo or a drum is a tuple of dozens of arrays: a fifth
of a cold start was spent on wrappers that nobody called. At import and compile time only, under numba's own lock.
"""

from typing import Any

from numba.core import sigutils
from numba.core.compiler_lock import global_compiler_lock

_UNWRAPPED = "no_cpython_wrapper"  # numba's option


def is_wrapped(compiled: Any) -> bool:
    """True when Python can call this result of a compile; without its wrapper it would jump to address 0."""
    return bool(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cpython_wrapper_name))


def wrap_when_called(dispatcher: Any) -> None:
    """Let other kernels have this one without a wrapper; a call from Python compiles it once more, with one."""
    options: dict[str, Any] = dispatcher._compiler.targetoptions
    normalized: Any = vars(sigutils)["normalize_signature"]  # which is not annotated
    overloads: dict[tuple[Any, ...], Any] = dispatcher.overloads
    template_for_kernel, compile_here, add_here = (
        dispatcher.get_call_template,
        dispatcher.compile,
        dispatcher.add_overload,
    )

    def get_call_template(args: Any, kws: Any) -> Any:
        # Asked for by another kernel, where its types are inferred.
        with global_compiler_lock:
            before = options.get(_UNWRAPPED, False)
            options[_UNWRAPPED] = True
            try:
                return template_for_kernel(args, kws)
            finally:
                options[_UNWRAPPED] = before

    def compile(sig: Any) -> Any:
        with global_compiler_lock:
            arguments: tuple[Any, ...] = normalized(sig)[0]
            known = overloads.get(arguments)
            if known is not None and not options.get(_UNWRAPPED, False) and not is_wrapped(known):
                del overloads[arguments]
            return compile_here(sig)

    def add_overload(compiled: Any) -> None:
        if is_wrapped(compiled):
            add_here(compiled)
        else:  # numba's own table, which its C code looks into when Python calls, must not know of it
            overloads[tuple(compiled.signature.args)] = compiled

    def wanted(stored: Any) -> bool:
        return options.get(_UNWRAPPED, False) or is_wrapped(stored)

    dispatcher.get_call_template = get_call_template
    dispatcher.compile = compile
    dispatcher.add_overload = add_overload
    if hasattr(dispatcher._cache, "wanted"):
        dispatcher._cache.wanted = wanted
