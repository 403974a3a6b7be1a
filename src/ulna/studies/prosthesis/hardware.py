"""What lies between a controller and the arm on the bench: encoder, noise, delay, supply, stops of the joint."""

from __future__ import annotations

from ulna.loop import Amplifier, EndStop, Guard, Hardware, MeasurementNoise, Quantiser, SafeOutput
from ulna.studies.prosthesis.plant import Bench
from ulna.studies.prosthesis.tasks import PERIOD

NOISE = 0.3
"""Standard deviation of the noise before the encoder's quantiser, in codes (choice)."""
LOST = 1e9
"""V from which a command counts as that of a controller that has lost itself; it gives 0 V then, as a watchdog does."""

_LOW, _HIGH = "max(-supply, -cell - cell_resistance*i)", "min(supply, cell - cell_resistance*i)"
_SINK, _SOURCE = "N*kb*omega - Ra*current", "N*kb*omega + Ra*current"


def hardware_of(bench: Bench) -> Hardware:
    """The hardware of a bench; benches differ in numbers only, infinite where there is no limit.

    The drive gives what the battery behind its resistance can, then no more than the amplifier's current limit; the
    amplifier measures the current, so it knows the winding of each plant.
    """
    return Hardware(
        period=PERIOD,
        delay=PERIOD,
        sensors={"y": Quantiser(step=bench.step)},
        noise={"y": MeasurementNoise(std=NOISE * bench.step)},
        drive=Amplifier(
            lower=f"max({_LOW}, min({_HIGH}, {_SINK}))",
            upper=f"min({_HIGH}, max({_LOW}, {_SOURCE}))",
            numbers={
                "supply": bench.voltage,
                "cell": bench.cell,
                "cell_resistance": bench.cell_resistance,
                "current": bench.current,
            },
        ),
        end_stops=(EndStop(position="theta", velocity="omega", lower=bench.walls[0], upper=bench.walls[1]),),
        guard=Guard(reaction=SafeOutput(0.0), largest=LOST),
    )
