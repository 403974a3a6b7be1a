"""What the design chain costs on a planar arm with n flexible joints: time, operations of the law, agreement.

The chain is f -> ad_f^k g -> ranks -> involutivity -> relative degree -> law u = beta^-1 (v - alpha). Every contender
gets the same equations (`ulna.plants.flexible_arm`); each run is a process of its own with a time limit, interleaved.
Time is CPU time of the chain without imports and without the equations of motion; the law of every contender is
evaluated at the same random states and compared with the law by CasADi's graph differentiation. Operations of laws that
leave a linear system to be solved in numbers are those of alpha and beta.

    python benchmarks/design_cost.py [--rounds 3] [--limit 60]
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.plants import flexible_joint_arm
from ulna.system import System

SIZES = {"sympy": (1, 2, 3, 4), "symengine": (1, 2, 3, 4), "casadi": (1, 2, 3, 4, 6), "ulna": (1, 2, 3, 4, 6, 8, 10)}
POINTS = 5
DEGREE = 4
TOLERANCE = 1e-8
Law = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What a contender found: ranks of G_0 … G_3, involutivity, the law and its operations."""

    ranks: list[int]
    involutive: bool
    operations: int
    law: Law


def places(n: int) -> tuple[np.ndarray, np.ndarray]:
    """(POINTS, 4n) states and (POINTS, n) new inputs, the same for everybody."""
    generator = np.random.default_rng(n)
    return generator.uniform(0.2, 1.2, (POINTS, 4 * n)), generator.uniform(-1, 1, (POINTS, n))


def rank(columns: np.ndarray) -> int:
    lengths = np.linalg.norm(columns, axis=0)
    kept = columns[:, lengths > TOLERANCE] / lengths[lengths > TOLERANCE]
    return int(np.linalg.matrix_rank(kept, tol=TOLERANCE)) if kept.size else 0


def closed_under_brackets(fields: np.ndarray, slopes: np.ndarray) -> bool:
    """Whether at one point the brackets of (k, N) fields with (k, N, N) Jacobians stay in their span."""
    products = np.einsum("aij,bj->abi", slopes, fields)
    brackets = (products - products.transpose(1, 0, 2)).reshape(-1, fields.shape[1])
    return rank(np.vstack([fields, brackets]).T) == rank(fields.T)


def judged(levels: list[np.ndarray], slopes: list[np.ndarray]) -> tuple[list[int], bool]:
    """Ranks of G_0 … and whether all but the last are involutive, from fields by level at one point."""
    ranks = [rank(np.vstack(levels[: k + 1]).T) for k in range(len(levels))]
    below = range(len(levels) - 1)
    closed = all(closed_under_brackets(np.vstack(levels[: k + 1]), np.vstack(slopes[: k + 1])) for k in below)
    return ranks, closed


def symbolic(arm: System, algebra: Any) -> Chain:
    """The chain in SymPy or SymEngine, plainly: nothing simplified once the accelerations are solved for."""
    n, m = len(arm.states), len(arm.inputs)
    x = [algebra.sympify(s) for s in arm.state_symbols]
    u = [algebra.sympify(s) for s in arm.input_symbols]
    rates = [algebra.sympify(e) for e in arm.inline(arm.rates)]
    zeros = dict.fromkeys(u, algebra.Integer(0))
    f = [e.xreplace(zeros) for e in rates]
    slopes_of_f = [[e.diff(s) for s in x] for e in f]

    def along(function: Any, field: Sequence[Any]) -> Any:
        return sum((function.diff(s) * c for s, c in zip(x, field, strict=True) if c != 0), algebra.Integer(0))

    def bracket(field: Sequence[Any]) -> list[Any]:
        pushed = [sum((a * c for a, c in zip(row, field, strict=True)), algebra.Integer(0)) for row in slopes_of_f]
        return [a - along(c, f) for a, c in zip(pushed, field, strict=True)]

    levels = [[[e.diff(s) for e in rates] for s in u]]
    while len(levels) < DEGREE:
        levels.append([bracket(field) for field in levels[-1]])
    alpha = [algebra.sympify(e) for e in arm.readouts]
    for _ in range(DEGREE - 1):
        alpha = [along(e, f) for e in alpha]
    beta = [along(e, field) for e in alpha for field in levels[0]]
    alpha = [along(e, f) for e in alpha]
    entries = [e for level in levels for field in level for e in field]
    slopes = [e.diff(s) for level in levels[:-1] for field in level for e in field for s in x]
    evaluate, _ = compiled(algebra, x, entries + slopes)
    values = evaluate(places(m)[0][0])
    fields = values[: len(entries)].reshape(DEGREE, m, n)
    jacobians = values[len(entries) :].reshape(DEGREE - 1, m, n, n)
    ranks, closed = judged(list(fields), list(jacobians))
    numbers, operations = compiled(algebra, x, [*alpha, *beta])

    def law(states: np.ndarray, new: np.ndarray) -> np.ndarray:
        row = numbers(states)
        return np.linalg.solve(row[m:].reshape(m, m), new - row[:m])

    return Chain(ranks=ranks, involutive=closed, operations=operations, law=law)


def compiled(algebra: Any, x: Sequence[Any], outputs: Sequence[Any]) -> tuple[Callable[[np.ndarray], np.ndarray], int]:
    """A function of the state, common subexpressions taken out, and its operations."""
    shared, rest = algebra.cse(list(outputs))
    operations = sum(int(algebra.count_ops(e)) for e in (*(e for _, e in shared), *rest))
    if algebra.__name__ == "symengine":
        program = algebra.Lambdify(list(x), list(outputs), cse=True)
        return (lambda states: np.array(program(states), dtype=float).ravel()), operations
    function = algebra.lambdify(list(x), list(outputs), modules="math", cse=lambda _: (shared, rest))
    return (lambda states: np.array(function(*states), dtype=float)), operations


def by_sympy(arm: System) -> Chain:
    import sympy

    return symbolic(arm, sympy)


def by_symengine(arm: System) -> Chain:
    import symengine

    return symbolic(arm, symengine)


def by_casadi(arm: System) -> Chain:
    """The chain by graph differentiation; the law solved in the graph."""
    import casadi as ca

    from ulna.program.lowering.casadi import to_casadi
    from ulna.system import system_kernel

    n, m = len(arm.states), len(arm.inputs)
    x, u, v = ca.SX.sym("x", n), ca.SX.sym("u", m), ca.SX.sym("v", m)
    outputs = to_casadi(system_kernel(arm).kernel)(ca.vertcat(x, u))
    rates, alpha = outputs[:n], outputs[n:]
    f = ca.substitute(rates, u, ca.SX.zeros(m))
    g = ca.jacobian(rates, u)
    levels = [[g[:, j] for j in range(m)]]
    while len(levels) < DEGREE:
        levels.append([ca.jtimes(f, x, field) - ca.jtimes(field, x, f) for field in levels[-1]])
    for _ in range(DEGREE - 1):
        alpha = ca.jtimes(alpha, x, f)
    beta = ca.jtimes(alpha, x, g)
    alpha = ca.jtimes(alpha, x, f)
    place = places(m)[0][0]
    stacked = [ca.vertcat(*level) for level in levels]
    both = ca.Function("both", [x], [*stacked, *(ca.jacobian(s, x) for s in stacked[:-1])])(place)
    fields = [np.array(part).reshape(m, n) for part in both[:DEGREE]]
    ranks, closed = judged(fields, [np.array(part).reshape(m, n, n) for part in both[DEGREE:]])
    program = ca.Function("law", [x, v], [ca.solve(beta, v - alpha)])
    moves = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT}
    operations = sum(program.instruction_id(k) not in moves for k in range(program.n_instructions()))

    def law(states: np.ndarray, new: np.ndarray) -> np.ndarray:
        return np.array(program(states, new)).ravel()

    return Chain(ranks=ranks, involutive=closed, operations=operations, law=law)


def by_ulna(arm: System) -> Chain:
    """The numeric road: ranks by graph differentiation, the law by jets."""
    from ulna.design.forms.law_kernel import compiled_law
    from ulna.geometry import numeric_structure
    from ulna.program import to_numpy
    from ulna.system import system_kernel

    found = numeric_structure(system_kernel(arm), np.zeros(len(arm.states)))
    compiled_program = compiled_law(arm).law
    program = to_numpy(compiled_program)
    return Chain(
        ranks=list(found.dimensions[:DEGREE]),
        involutive=found.involutive.holds,
        operations=compiled_program.operation_count,
        law=lambda states, new: np.array(program(*states, *new)),
    )


CONTENDERS = {"sympy": by_sympy, "symengine": by_symengine, "casadi": by_casadi, "ulna": by_ulna}


def one_run(name: str, n: int) -> None:
    """Run one contender in this process and print what it found as JSON."""
    arm = flexible_joint_arm(n)
    CONTENDERS[name](flexible_joint_arm(1))  # imports and first calls are not what is compared
    start = time.process_time()
    chain = CONTENDERS[name](arm)
    seconds = time.process_time() - start
    values = [chain.law(s, v).tolist() for s, v in zip(*places(n), strict=True)]
    found = {"ranks": chain.ranks, "involutive": chain.involutive, "operations": chain.operations}
    print(json.dumps({"seconds": seconds, "law": values, **found}))


def in_a_process(name: str, n: int, limit: float) -> dict[str, Any] | None:
    """The result of one run; None past the limit."""
    try:
        done = subprocess.run(  # noqa: S603 - this very file
            [sys.executable, __file__, "--one", name, str(n)], timeout=limit, capture_output=True, text=True, check=True
        )
    except subprocess.TimeoutExpired:
        return None
    return json.loads(done.stdout.splitlines()[-1])


def table(rounds: int, limit: float) -> None:
    runs: dict[tuple[str, int], list[dict[str, Any]]] = {}
    late: set[str] = set()
    for _ in range(rounds):
        for n in sorted({n for sizes in SIZES.values() for n in sizes}):
            for name in CONTENDERS:
                if n not in SIZES[name] or name in late:
                    continue
                found = in_a_process(name, n, limit)
                if found is None:
                    late.add(name)
                    print(f"{name}: n = {n} takes more than {limit:g} s", flush=True)
                else:
                    runs.setdefault((name, n), []).append(found)
    print("| n | contender | s (CPU, median) | ratio to ulna | operations | law off CasADi's by | ranks | involutive |")
    print("|---|---|---|---|---|---|---|---|")
    for name, n in sorted(runs, key=lambda pair: (pair[1], pair[0])):
        row = runs[name, n]
        seconds = statistics.median(one["seconds"] for one in row)
        own = statistics.median(one["seconds"] for one in runs["ulna", n]) if ("ulna", n) in runs else float("nan")
        off = "–"
        if name != "casadi" and ("casadi", n) in runs:
            truth = np.array(runs["casadi", n][0]["law"])
            off = f"{np.abs(np.array(row[0]['law']) - truth).max() / np.abs(truth).max():.1e}"
        ranks = ", ".join(map(str, row[0]["ranks"]))
        ratio = f"{seconds / own:.2g}"
        cells = (n, name, f"{seconds:.3f}", ratio, row[0]["operations"], off, ranks, row[0]["involutive"])
        print("| " + " | ".join(map(str, cells)) + " |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--one", nargs=2, metavar=("CONTENDER", "N"), help="one run, result as JSON")
    chosen = parser.parse_args()
    if chosen.one:
        one_run(chosen.one[0], int(chosen.one[1]))
    else:
        table(chosen.rounds, chosen.limit)
