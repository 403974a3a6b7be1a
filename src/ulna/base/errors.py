"""What ulna raises: one clear message in three parts, never a bare traceback for a user's mistake."""

from __future__ import annotations

import re

_ENDLESS = re.compile(r"\S{300,}")
"""What is no word: thousands of letters typed or read by mistake must not bury the message about them."""


class UlnaError(Exception):
    """A mistake or a limit that the user can act on.

    Args:
        asked: what was asked for, in the user's words (`"parameter m2 of arm.toml"`).
        found: what was found instead, with names, numbers and places.
        hint: what to try next; left out where there is nothing useful to say.
        value: the value (a `Verdict`, an analysis) that says no, when there is one.

    Examples:
        >>> error = ulna.UlnaError("mass m", "it is negative.", "Give a value above 0.")
        >>> print(error)
        mass m: it is negative. Give a value above 0.
        >>> error.hint
        'Give a value above 0.'
    """

    def __init__(self, asked: str, found: str, hint: str = "", *, value: object = None) -> None:
        self.asked = asked
        self.found = found
        self.hint = hint
        self.value = value
        super().__init__(str(self))

    def __str__(self) -> str:
        text = f"{self.asked}: {self.found}"
        return printable(f"{text} {self.hint}" if self.hint else text)


def printable(text: str) -> str:
    """The text with control characters spelt out: names of others must not steer the terminal they are shown on.

    Words of hundreds of letters are cut.
    """
    text = _ENDLESS.sub(lambda found: f"{found[0][:60]}... ({len(found[0])} characters)", text)
    if text.isprintable():
        return text
    return "".join(sign if sign.isprintable() or sign in "\n\t" else ascii(sign)[1:-1] for sign in text)


class UlnaWarning(UserWarning):
    """Something allowed that the user should know: an unstable pole, a value outside its range.

    Examples:
        >>> import warnings
        >>> warnings.filterwarnings("always", category=ulna.UlnaWarning)  # each time, not once a line
    """


class FormulaError(UlnaError):
    """A formula that cannot be read: syntax, unknown name or function, runaway power.

    Examples:
        >>> try:
        ...     ulna.system_from_mapping({"name": "tank", "states": {"h": {"equation": "-sqr(h)"}}})
        ... except ulna.FormulaError as error:
        ...     print(error.asked)
        equation of state 'h' in plant
    """


class PlantError(UlnaError):
    """A plant that contradicts itself: missing equation, cyclic definition, duplicate name.

    Examples:
        >>> try:
        ...     ulna.model("dufing")
        ... except ulna.PlantError as error:
        ...     print(error)
        plant 'dufing': no plant of this name is in the catalogue. Did you mean duffing?
    """


class UnitError(UlnaError):
    """A unit that is unknown, or a formula whose dimension is not the one due.

    Examples:
        >>> plant = {"name": "cart", "states": {"x": {"unit": "parsecs", "equation": "0"}}}
        >>> try:
        ...     ulna.system_from_mapping(plant)
        ... except ulna.UnitError as error:
        ...     print(error.asked)
        unit 'parsecs' of states 'x' in plant
    """


class NotAffineError(UlnaError):
    """A plant whose right-hand side is not affine in its inputs.

    Examples:
        >>> data = {"name": "p", "inputs": {"u": {}}, "states": {"x": {"equation": "sin(u)"}}}
        >>> try:
        ...     ulna.control_affine(ulna.system_from_mapping(data))
        ... except ulna.NotAffineError as error:
        ...     print(error.found)
        the term sin(u) is not affine in the input u.
    """


class NoFormError(UlnaError):
    """A form (controller, observer, input-output) that this plant does not have; `value` says why.

    Examples:
        >>> try:
        ...     ulna.controller_form("cart_pole")
        ... except ulna.NoFormError as error:
        ...     print(error.hint)
        Dynamic extension cannot help with one input; try `input_output_form`.
    """


class DesignError(UlnaError):
    """Design data that cannot be used: wrong number of poles, unpaired complex pole, bad weight.

    Examples:
        >>> try:
        ...     ulna.state_feedback("duffing", [-1])
        ... except ulna.DesignError as error:
        ...     print(error)
        poles: 1 given (-1), 2 needed. Give one of the poles for each coordinate of each chain.
    """


class SimulationError(UlnaError):
    """A simulation that cannot be started or did not reach its end.

    Examples:
        >>> try:
        ...     ulna.Taylor(tolerance=1)
        ... except ulna.SimulationError as error:
        ...     print(error.hint)
        1e-13 is usual.
    """


class OptionalDependencyError(UlnaError):
    """A feature whose extra is not installed.

    Examples:
        >>> print(ulna.OptionalDependencyError("a sweep on many machines", "campaign"))
        a sweep on many machines: the extra [campaign] is not installed. Run: pip install 'ulna[campaign]'
    """

    def __init__(self, feature: str, extra: str) -> None:
        super().__init__(feature, f"the extra [{extra}] is not installed.", f"Run: pip install 'ulna[{extra}]'")
