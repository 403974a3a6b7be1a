"""Plants with a known observer form, hidden behind a change of coordinates and, if wanted, of the output."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

import sympy as sp

from ulna.symbolic.exact.quotients import normal_form
from ulna.symbolic.formulas import formula
from ulna.system import System, system_from_mapping

Y = sp.Symbol("y", real=True)

INJECTIONS: tuple[sp.Expr, ...] = (
    sp.Integer(0),
    Y,
    Y**2,
    -(Y**3),
    sp.sin(Y),
    sp.exp(-Y),
    Y * sp.cos(Y),
    1 / (1 + Y**2),
    sp.Symbol("p", real=True) * Y,
)

MEASURED: dict[str, Callable[[sp.Expr], sp.Expr]] = {
    "log": sp.log,
    "exp": sp.exp,
    "atan": sp.atan,
    "cube": lambda y: y + y**3,
    "reciprocal": lambda y: 1 / y,
    "root": sp.sqrt,
    "power": lambda y: y ** sp.Rational(5, 2),
}


def disguised(
    coordinates: Sequence[sp.Expr],
    output: sp.Expr,
    psi: sp.Expr,
    drift: Sequence[sp.Expr],
    inputs: Sequence[Sequence[sp.Expr]] = (),
) -> System:
    """The plant in x for which z = T(x) obeys z_k' = z_{k−1} + a_k(y) + c_k(y) u, ψ(y) = z_n, y = h(x).

    Args:
        coordinates: (n,) T(x) in x1 … xn; the last must be ψ(h(x)).
        output: h(x).
        psi: ψ in the symbol y.
        drift: (n,) a in y; inputs: for every input its (n,) c in y.
    """
    n = len(coordinates)
    x = sp.symbols(f"x1:{n + 1}", real=True)
    assert sp.simplify(coordinates[-1] - psi.subs(Y, output)) == 0
    u = [sp.Symbol(f"u{j + 1}", real=True) for j in range(len(inputs))]
    right = []
    for k in range(n):
        rate = drift[k] + sum((c[k] * v for c, v in zip(inputs, u, strict=True)), sp.Integer(0))
        right.append((coordinates[k - 1] if k else 0) + sp.sympify(rate).subs(Y, output))
    rates = sp.Matrix(coordinates).jacobian(x).LUsolve(sp.Matrix(right))
    return system_from_mapping(
        {
            "name": "disguised",
            "states": {s.name: formula(normal_form(r)) for s, r in zip(x, rates, strict=True)},
            "inputs": {v.name: {} for v in u},
            "outputs": {"y": formula(output)},
            "parameters": {"p": {}},
            "operating_point": {s.name: 1 for s in x},
        }
    )


def random_disguise(seed: int, *, transformed: str | None = None, bent: bool = False) -> System:
    """A plant by chance: triangular polynomial T, injections from the menu, up to one input.

    Args:
        seed: of the choices.
        transformed: a name in `MEASURED`, or None for an output that needs no transformation.
        bent: measure a function of several states instead of a state.
    """
    chance = random.Random(seed)
    n = chance.choice((2, 3, 3))
    x = sp.symbols(f"x1:{n + 1}", real=True)
    psi = MEASURED[transformed](Y) if transformed else Y
    output = x[-1]
    T = [x[k] + chance.choice((1, -1, 2)) * chance.choice(x[k + 1 :]) * x[-1] for k in range(n - 1)]
    if chance.random() < 0.3:
        T[0] = T[0] - x[0] + sp.exp(x[0])
    if bent:
        shift = {x[-1]: x[-1] + chance.choice((1, -1)) * x[0] ** 2}
        output = output.subs(shift)
        T = [t.subs(shift) for t in T]
    drift = [chance.choice(INJECTIONS) + chance.choice(INJECTIONS) for _ in range(n)]
    inputs = [[chance.choice(INJECTIONS) for _ in range(n)]] if chance.random() < 0.6 else []
    return disguised([*T, psi.subs(Y, output)], output, psi, drift, inputs)
