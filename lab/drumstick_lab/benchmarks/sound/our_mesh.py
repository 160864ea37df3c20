"""Our mesh in a process of its own: reads lines "across steps", answers with CPU seconds.

A process, because the compiler decides once what processor it compiles for: NUMBA_CPU_NAME and NUMBA_CPU_FEATURES.
"""

import os
import subprocess
import sys


class Ours:
    """`cpu_s` runs so many steps of the mesh. avx2: in code for a processor without AVX-512."""

    def __init__(self, avx2: bool = False) -> None:
        environment = dict(os.environ)
        if avx2:
            import llvmlite.binding as llvm

            has = dict(llvm.get_host_cpu_features())
            kept = [
                f"+{name}" for name in ("avx", "avx2", "fma", "bmi", "bmi2", "f16c", "popcnt") if has[name]
            ]
            environment |= {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ",".join(kept)}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "drumstick_lab.benchmarks.sound.our_mesh"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env=environment,
        )
        self.lanes = int(self._answer("lanes"))

    def _answer(self, question: str) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(question + "\n")
        answer = self._process.stdout.readline()
        if not answer:
            raise ChildProcessError(f"ours ended with {self._process.wait()}")
        return answer

    def cpu_s(self, across: int, steps: int) -> float:
        """CPU seconds of `steps` steps, an even number, of a mesh so many junctions across."""
        return float(self._answer(f"{across} {steps}"))

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(10.0)


def main() -> None:
    from drumstick.drum.membrane.simd import WIDTH
    from drumstick_lab.benchmarks.sound.bare_mesh import BareMesh, timed

    meshes: dict[int, BareMesh] = {}
    for line in sys.stdin:
        if line == "lanes\n":
            print(WIDTH, flush=True)
            continue
        across, steps = (int(word) for word in line.split())
        mesh = meshes.setdefault(across, BareMesh(across))
        print(timed(lambda mesh=mesh, steps=steps: mesh.run(steps)), flush=True)


if __name__ == "__main__":
    main()
