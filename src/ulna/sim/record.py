"""What is kept of many runs: `Ends`, `Figures` or `Paths`."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """Only how each run ended; figures of continuous runs, which cost time, are NaN.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> many = ulna.simulate(spring, np.ones((3, 2)), 5.0, record=ulna.Ends())
        >>> many.end_time
        array([5., 5., 5.])
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """Figures of every output: settling, overshoot, steady and peak error.

    A sampled loop takes them at its samples. Continuous runs take them off the polynomials of their steps, to about
    the tolerance; those that go one by one (jumps, limits, end stops, inputs that are no constants) are looked at on so
    many intervals.

    Args:
        samples: intervals of runs that go one by one.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> many = ulna.simulate(spring, [[1, 0], [2, 0]], 60.0, record=ulna.Figures(samples=1000))
        >>> many.settling_time.round(2)
        array([[14.66],
               [14.66]])
    """

    samples: int = 500

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise SimulationError(f"Figures(samples={self.samples})", "expected at least one interval.")


@dataclass(frozen=True, slots=True)
class Paths:
    """Figures, and the paths of some signals: `Paths("theta", "u")`.

    Args:
        names: states, outputs, estimates, commands (`u_command`), measured values (`y_measured`) and so on.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> many = ulna.simulate(spring, [[1, 0], [2, 0]], 5.0, record=ulna.Paths("y"))
        >>> many.paths["y"].shape
        (2, 2)
    """

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", names)


Record = Ends | Figures | Paths
