"""LaTeX names of letters, signs and brackets, and what they are on a page."""

from __future__ import annotations

from typing import Final

LETTERS: Final = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ϵ", "varepsilon": "ε", "zeta": "ζ", "eta": "η",
    "theta": "θ", "iota": "ι", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ",
    "sigma": "σ", "tau": "τ", "phi": "ϕ", "varphi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω", "Gamma": "Γ",
    "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Sigma": "Σ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω", "infty": "∞",
    "partial": "∂", "ell": "ℓ",
}  # fmt: skip
"""Set as identifiers."""

SIGNS: Final = {
    "cdot": "⋅", "times": "×", "pm": "±", "mp": "∓", "approx": "≈", "neq": "≠", "ne": "≠", "leq": "≤", "le": "≤",
    "geq": "≥", "ge": "≥", "in": "∈", "to": "→", "rightarrow": "→", "mapsto": "↦", "nabla": "∇", "langle": "⟨",
    "rangle": "⟩", "dots": "…", "ldots": "…", "cdots": "⋯", "vdots": "⋮", "ddots": "⋱", "circ": "∘", "{": "{",
    "}": "}", "|": "‖", "colon": ":",
}  # fmt: skip
"""Set as operators."""

SPACES: Final = {
    ",": "0.167em",
    ":": "0.222em",
    ";": "0.278em",
    " ": "0.333em",
    "quad": "1em",
    "qquad": "2em",
    "!": "0em",
}
"""Command of a space → its width."""

FUNCTIONS: Final = frozenset({
    "cos", "sin", "tan", "cot", "sec", "csc", "arccos", "arcsin", "arctan", "cosh", "sinh", "tanh", "exp", "log", "ln",
    "max", "min", "det", "rank", "span", "sign",
})  # fmt: skip
"""Functions with a name of several letters, set upright."""

ACCENTS: Final = {"dot": "˙", "ddot": "¨", "overline": "‾", "bar": "‾", "hat": "^", "tilde": "~"}
"""Set over their argument."""

BRACKETS: Final = {
    "(": "(", ")": ")", "[": "[", "]": "]", r"\{": "{", r"\}": "}", "|": "|", ".": "", r"\langle": "⟨", r"\rangle": "⟩",
    r"\lbrace": "{", r"\rbrace": "}",
}  # fmt: skip
"""What may follow `\\left` and `\\right`."""

MATRICES: Final = {
    "matrix": ("", ""),
    "bmatrix": ("[", "]"),
    "pmatrix": ("(", ")"),
    "cases": ("{", ""),
    "aligned": ("", ""),
}
"""Environment → its brackets."""

DOUBLE_STRUCK: Final = {"R": "ℝ", "C": "ℂ", "N": "ℕ", "Z": "ℤ", "Q": "ℚ"}
"""Number sets."""
