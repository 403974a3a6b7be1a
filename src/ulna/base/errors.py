"""What ulna raises: one clear message in three parts, never a bare traceback for a user's mistake."""

from __future__ import annotations


class UlnaError(Exception):
    """A mistake or a limit that the user can act on.

    Args:
        asked: what was asked for, in the user's words (`"parameter m2 of arm.toml"`).
        found: what was found instead, with names, numbers and places.
        hint: what to try next; left out where there is nothing useful to say.
        value: the value (a `Verdict`, an analysis) that says no, when there is one.
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
    """The text with control characters spelt out: names of others must not steer the terminal they are shown on."""
    if text.isprintable():
        return text
    return "".join(sign if sign.isprintable() or sign in "\n\t" else ascii(sign)[1:-1] for sign in text)


class UlnaWarning(UserWarning):
    """Something allowed that the user should know: an unstable pole, a value outside its range."""


class FormulaError(UlnaError):
    """A formula that cannot be read: syntax, unknown name or function, runaway power."""


class PlantError(UlnaError):
    """A plant that contradicts itself: missing equation, cyclic definition, duplicate name."""


class UnitError(UlnaError):
    """A unit that is unknown, or a formula whose dimension is not the one due."""


class NotAffineError(UlnaError):
    """A plant whose right-hand side is not affine in its inputs."""


class NoFormError(UlnaError):
    """A form (controller, observer, input-output) that this plant does not have; `value` says why."""


class DesignError(UlnaError):
    """Design data that cannot be used: wrong number of poles, unpaired complex pole, bad weight."""


class SimulationError(UlnaError):
    """A simulation that cannot be started or did not reach its end."""


class OptionalDependencyError(UlnaError):
    """A feature whose extra is not installed."""

    def __init__(self, feature: str, extra: str) -> None:
        super().__init__(feature, f"the extra [{extra}] is not installed.", f"Run: pip install 'ulna[{extra}]'")
