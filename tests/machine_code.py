"""Compiled form of a kernel: its IR's order of shared accesses, and the instructions on two processors.

`Order` looks at every path through the optimised IR of one compiled function, argument by argument: which of its plain
loads and stores can happen before an acquire or after a release.
"""

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numba
from llvmlite import binding as llvm

AARCH64, X86_64 = "aarch64-unknown-linux-gnu", "x86_64-unknown-linux-gnu"

llvm.initialize_all_targets()
llvm.initialize_all_asmprinters()


class Compiled:
    """One kernel, compiled afresh for these arguments as `kernels.jit` compiles it: a cached one has no IR to show."""

    def __init__(self, dispatcher: Any, *arguments: Any) -> None:
        options = {k: v for k, v in dispatcher.targetoptions.items() if k != "nopython"}
        fresh = numba.njit(**options)(dispatcher.py_func)
        signature = tuple(numba.typeof(a) for a in arguments)
        fresh.compile(signature)
        self.name: str = fresh.overloads[signature].fndesc.llvm_func_name
        self.ir: str = fresh.inspect_llvm(signature)

    def linked(self) -> set[str]:
        """The dotted names of every function in this text, those too that were inlined or folded away."""
        return _linked(self.ir)

    def _alone(self) -> str:
        # This function by itself: whatever it calls is declared. numba's reference counts speak x86, and a processor
        # that does not know an instruction ends the whole process.
        whole = llvm.parse_assembly(self.ir)
        body = re.sub(r", ![a-z.]+ ![0-9]+| #[0-9]+", "", str(whole.get_function(self.name)))
        assert "llvm.x86" not in body
        called = set(re.findall(r"call [^@]*@([\w.$]+)\(", body))
        for function in whole.functions:
            if function.name in called:
                kind = str(function.global_value_type)
                returned, _, arguments = kind.partition(" (")
                body += f"declare {returned} @{function.name}({arguments}\n"
        return body

    def assembly(self, machine: str) -> list[str]:
        """The function's instructions there, one a line, optimised once more by that processor's own passes."""
        module = llvm.parse_assembly(self._alone())
        target = llvm.Target.from_triple(machine).create_target_machine(cpu="generic", opt=3)
        module.triple, module.data_layout = machine, str(target.target_data)
        passes = llvm.create_pass_builder(target, llvm.create_pipeline_tuning_options(3))
        passes.getModulePassManager().run(module, passes)
        text = target.emit_assembly(module)
        begin = text.index(f"\n{self.name}:")
        lines = text[begin : text.index(".Lfunc_end", begin)].splitlines()
        return [line.strip() for line in lines if line.startswith("\t") and not line.startswith("\t.")]


def linked_within(dispatcher: Any, *arguments: Any) -> set[str]:
    """The same of a kernel as other kernels have it: the store keeps its text, so it is compiled once for all tests."""
    types = tuple(numba.typeof(a) for a in arguments)
    dispatcher.get_call_template(types, {})
    return _linked(dispatcher.overloads[types].library.get_llvm_str())


def _linked(ir: str) -> set[str]:
    # numba leaves one symbol for each (`NumbaEnv` and the mangled name), also for one that came from the cache.
    return {_demangled(name) for name in re.findall(r"^@_ZN08NumbaEnv([^ ]*) =", ir, re.M)}


def _demangled(name: str) -> str:
    # numba's names: the length of each part, then the part; what follows are the arguments' types.
    parts: list[str] = []
    while length := re.match(r"[0-9]+", name):
        name = name[length.end() :]
        parts.append(name[: int(length.group())])
        name = name[int(length.group()) :]
    return ".".join(parts).replace("_3clocals_3e", "<locals>")


def count(lines: list[str], *patterns: str) -> int:
    """Number of instructions that begin with one of these patterns."""
    return sum(1 for line in lines if any(re.match(p, line) for p in patterns))


def last(lines: list[str], *patterns: str) -> int:
    """Place of the last of these instructions; -1 when there is none."""
    return max((at for at, line in enumerate(lines) if any(re.match(p, line) for p in patterns)), default=-1)


class Instruction(NamedTuple):
    """One line of a function's IR. `array`: the argument whose memory a load or store touches; "" for its own."""

    opcode: str
    text: str
    array: str

    def orders(self, *words: str) -> bool:
        """Is it an atomic access with one of these orderings?"""
        return "atomic" in self.text and any(
            f" {word}," in self.text for word in (*words, "acq_rel", "seq_cst")
        )

    def is_plain(self, opcode: str, array: str) -> bool:
        """Is it an ordinary load or store of this array?"""
        return self.opcode == opcode and "atomic" not in self.text and bool(array) and self.array == array


class Order:
    """Orders in which plain accesses to an argument's memory can come, on any path through a function."""

    def __init__(self, compiled: Compiled) -> None:
        function = llvm.parse_assembly(compiled.ir).get_function(compiled.name)
        texts = {str(b): [(i.opcode, str(i).strip()) for i in b.instructions] for b in function.blocks}
        made = {
            text.partition(" = ")[0]: text for lines in texts.values() for _, text in lines if " = " in text
        }
        self._blocks: dict[str, list[Instruction]] = {}
        self._next: dict[str, list[str]] = {}
        for whole, lines in texts.items():
            name = whole.strip().partition(":")[0]
            self._blocks[name] = [Instruction(op, text, _array(op, text, made)) for op, text in lines]
            self._next[name] = re.findall(r"label %([\w.$-]+)", lines[-1][1])
        self._first = next(iter(self._blocks))

    def _from(self, block: str, start: int, stop: Callable[[Instruction], bool]) -> Iterator[Instruction]:
        # Every instruction that can follow, up to those that `stop` on each path, and not beyond.
        todo, done = [(block, start)], set[tuple[str, int]]()
        while todo:
            name, at = todo.pop()
            if (name, at) in done:
                continue
            done.add((name, at))
            for instruction in self._blocks[name][at:]:
                if stop(instruction):
                    break
                yield instruction
            else:
                todo += [(following, 0) for following in self._next[name]]

    def everywhere(self) -> Iterator[tuple[str, int, Instruction]]:
        """Block, place in it, instruction."""
        for name, instructions in self._blocks.items():
            for at, instruction in enumerate(instructions):
                yield name, at, instruction

    def faults(self, cells: str, written: str = "", read: str = "") -> list[str]:
        """Faults, in words; none when the order is safe.

        `cells`: the array of counters, `written` and `read`: arrays of records that this function fills for the other
        side and takes from it. A record must be filled before a release on every path and never after one, and taken
        after an acquire and before a release; counters may be stored by atomic instructions only.
        """

        def acquires(i: Instruction) -> bool:
            return i.array == cells and i.opcode != "store" and i.orders("acquire")

        def releases(i: Instruction) -> bool:
            return i.array == cells and i.opcode != "load" and i.orders("release")

        found: set[str] = set()
        if any(i.is_plain("load", read) for i in self._from(self._first, 0, acquires)):
            found.add("a record is read before an acquire")
        for name, at, here in self.everywhere():
            after = self._from(name, at + 1, lambda _: False)
            if here.is_plain("store", cells):
                found.add("a counter is stored by a plain store")
            if releases(here) and any(i.is_plain("store", written) for i in after):
                found.add("a record is written after a release")
            touched = here.is_plain("store", written) or here.is_plain("load", read)
            if touched and any(i.opcode == "ret" for i in self._from(name, at + 1, releases)):
                found.add("a record is written or read and no release follows")
        return sorted(found)


def _array(opcode: str, text: str, made: dict[str, str]) -> str:
    if opcode not in ("load", "store", "atomicrmw"):
        return ""
    todo, done = [re.findall(r"ptr (%[\w.$-]+)", text)[-1]], set[str]()
    while todo:
        address = todo.pop()
        if address.startswith("%arg."):
            return address.split(".")[1]
        if address not in done and (line := made.get(address)):
            todo += re.findall(r"(?:ptr|\[) (%[\w.$-]+)", line)  # of an offset, a choice, or a phi
        done.add(address)
    return ""
