"""Kernels that only kernels call are optimised and turned into machine code once: within the kernel that Python calls.

numba does both for the library of each function, with all that it calls linked in, so the innermost kernels were
optimised and emitted again at every level above them: a third of a cold start. A library without a wrapper for Python
or C keeps LLVM's code for its callers to take in, here and in the store. At compile time only, under numba's own
lock.

Leans on numba 0.68's private `CPUCodeLibrary`: it has no public way to leave a library unfinished. And on llvmlite's
list of what it calls around each of its functions: numba's two note the time for every kernel in whose compilation the
present one is nested, with 75 000 calls in a first start of the servo.
"""

import llvmlite.binding as llvm
from numba.core import codegen, typed_passes

_lower = typed_passes.BaseNativeLowering.run_pass
_set_env = codegen.JITCPUCodegen.set_env


class KernelLibrary(codegen.JITCodeLibrary):
    """numba's library of one compiled function; `is_inner`: neither Python nor C calls it."""

    is_inner = False

    def _optimize_final_module(self):
        if not self.is_inner:
            super()._optimize_final_module()

    def _finalize_final_module(self):
        if not self.is_inner:
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name):
        """Address of a function's machine code; 0 when there is none, as in an inner library."""
        self._ensure_finalized()
        return 0 if self.is_inner else super().get_pointer_to_function(name)

    def serialize_using_object_code(self):
        """State for the store: of an inner library LLVM's code only."""
        if not self.is_inner:
            return super().serialize_using_object_code()
        return self.name, "inner", self._get_module_for_linking().as_bitcode()

    @classmethod
    def _unserialize(cls, codegen, state):
        name, kind, data = state
        if kind != "inner":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        library.is_inner = True
        library._final_module = library._shared_module = llvm.parse_bitcode(data)
        library._finalized = True
        return library


def _lower_into_kernel_library(lowering, state):
    if state.library is None:
        state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
        state.library.is_inner = bool(state.flags.no_cpython_wrapper and state.flags.no_cfunc_wrapper)
        state.library.enable_object_caching()
    return _lower(lowering, state)


def _set_env_if_there(own, name, env):
    # An inner library has no such variable. It is for Python's objects, which kernels do not have.
    if own._engine.get_global_value_address(name):
        _set_env(own, name, env)


def install() -> None:
    """Let numba make its libraries this way from now on. Idempotent."""
    codegen.JITCPUCodegen._library_class = KernelLibrary
    codegen.JITCPUCodegen.set_env = _set_env_if_there
    typed_passes.BaseNativeLowering.run_pass = _lower_into_kernel_library
    llvm.ffi.lib._lock._cblist.clear()
