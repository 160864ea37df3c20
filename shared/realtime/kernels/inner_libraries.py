"""Kernels that only kernels call are optimised and turned into machine code once: within the kernel that Python calls.

numba does both for each library of its own, with everything below it linked in, so the innermost kernels were optimised
and emitted again at every level above them: two thirds of a cold start. A library without a wrapper for Python keeps
its code as LLVM's, after the cheap passes, for its callers to take in. At compile time only, under numba's own lock.
"""

from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen, typed_passes

_set_env_of_numba: Any = codegen.JITCPUCodegen.set_env
_lower_and_finalize: Any = typed_passes.BaseNativeLowering.run_pass


class KernelLibrary(codegen.JITCodeLibrary):
    """numba's library of one compiled function; `is_inner`: neither Python nor C calls it."""

    is_inner = False

    def _optimize_final_module(self) -> None:
        if not self.is_inner:  # else within its caller
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        if not self.is_inner:
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function, 0 when there is none here: an inner library has no machine code."""
        self._ensure_finalized()
        return 0 if self.is_inner else super().get_pointer_to_function(name)

    def serialize_using_object_code(self) -> Any:
        """State for the store: an inner library has LLVM's code only."""
        if not self.is_inner:
            return super().serialize_using_object_code()
        self._ensure_finalized()
        return self.name, "inner", self._get_module_for_linking().as_bitcode()

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != "inner":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        library.is_inner = True
        library._final_module = library._shared_module = llvm.parse_bitcode(data)
        library._finalized = True
        return library


def _run_pass(self: Any, state: Any) -> Any:
    if state.library is None:
        library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
        library.is_inner = bool(state.flags.no_cpython_wrapper and state.flags.no_cfunc_wrapper)
        library.enable_object_caching()
        state.library = library
    return _lower_and_finalize(self, state)


def _set_env(self: Any, env_name: str, env: Any) -> None:
    # Of an inner library there is no such variable; compiled code without Python's objects does not look at it.
    if self._engine.get_global_value_address(env_name):
        _set_env_of_numba(self, env_name, env)


def install() -> None:
    """Let numba make its libraries this way, from here on."""
    codegen.JITCPUCodegen._library_class = KernelLibrary
    codegen.JITCPUCodegen.set_env = _set_env
    typed_passes.BaseNativeLowering.run_pass = _run_pass
