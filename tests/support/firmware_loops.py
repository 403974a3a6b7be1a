"""Loops of many kinds that firmware is made of."""

from __future__ import annotations

from functools import cache
from typing import Any

import ulna
from ulna.loop import (
    Amplifier,
    ConditionalIntegration,
    Deadline,
    Euler,
    ExactHold,
    Guard,
    Hardware,
    InnovationLimit,
    Jitter,
    Loop,
    MissedSamples,
    Pwm,
    Quantiser,
    ReferenceRange,
    SafeOutput,
    Saturation,
    SlewLimit,
)
from ulna.program import Plain
from ulna.system import system_from_mapping

LIMIT = Saturation(lower=-24.0, upper=24.0)
ENCODER = Quantiser.encoder(bits=12)
PID = {
    "name": "PID with a filtered derivative",
    "states": {"total": "ki*(theta_ref - theta)", "slow": "(theta - slow)/Tf"},
    "inputs": {"theta": {}, "theta_ref": {}},
    "outputs": {"u": "kp*(theta_ref - theta) + total - kd*(theta - slow)/Tf"},
    "parameters": {"kp": {"value": 40}, "ki": {"value": 20}, "kd": {"value": 5}, "Tf": {"value": "0.02"}},
}
CATALOGUE = (
    "boost_converter",
    "duffing",
    "series_dc_motor",
    "slotine_li_input_state",
    "strict_feedback",
    "synchronous_generator",
    "tank_cascade",
    "two_link_arm",
    "two_mass_cubic_spring",
    "zak_one_link_arm",
)
"""Plants with a law on their whole state: roots, powers, divisions, sines; one or two inputs."""


def _with(plant: Any, controller: Any, **parts: Any) -> Loop:
    return Loop(plant=plant, controller=controller, hardware=Hardware(arithmetic=Plain(), **{"period": 1e-3, **parts}))


@cache
def arm_loops() -> dict[str, Loop]:
    """Loops of the one-link arm by what is particular about them."""
    arm = ulna.model("one_link_arm").with_values()
    form = ulna.controller_form(arm)
    law = ulna.state_feedback(form, ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    exact = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    both = ulna.compensator(law, exact)
    injected = ulna.compensator(law, ulna.injected_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11)))
    eager = ulna.state_feedback(form, ulna.Poles(-2, -3, -4, -5), reference=ulna.SetPoint(), integral=True)
    noise = ulna.KalmanNoise(process=[0, 0, 10], measurement=["1e-9"])
    seen = ulna.compensator(law, ulna.extended_kalman_filter(arm, noise))
    cut = Amplifier(lower="-24 - 0.2*i", upper="24 - 0.2*i")
    return {
        "paper": _with(arm, both, sensors=ENCODER, saturation=LIMIT, delay=1e-3),
        "exact hold": _with(arm, injected, sensors=ENCODER, saturation=LIMIT, discretisation=ExactHold()),
        "integral": _with(
            arm,
            ulna.compensator(eager, exact),
            saturation=LIMIT,
            slew=SlewLimit(rate=500.0),
            delay=1.4e-3,
            drive=Pwm(frequency=2e4, supply=24.0, sag=0.1),
            anti_windup=ConditionalIntegration(states=("e1_int",)),
        ),
        "states": _with(arm, law, sensors={"theta": ENCODER}, discretisation=Euler()),
        "PID": _with(arm, system_from_mapping(PID), saturation=LIMIT, delay=3e-3),
        "Kalman": _with(arm, seen, sensors=ENCODER, saturation=LIMIT),
        "watched": _with(
            arm,
            ulna.compensator(eager, exact),
            sensors=ENCODER,
            saturation=LIMIT,
            delay=1e-3,
            guard=Guard(reaction=SafeOutput(0.0)),
            clock=(Jitter(width=2e-4), MissedSamples(probability=0.2)),
            deadline=Deadline(lateness=1.5e-4, missed=2, reaction=SafeOutput(0.5)),
            references=ReferenceRange(lower=-0.5, upper=0.5, held=True),
            innovation=InnovationLimit(size={"y": 0.05}, samples=5, resume=10, reaction=SafeOutput({"u": -0.5})),
        ),
        "amplifier": _with(arm, both, drive=cut),
    }


@cache
def catalogue_loop(name: str) -> Loop:
    """A catalogue plant under its law, behind limits and two samples of delay."""
    plant = ulna.model(name).with_values()
    form = ulna.controller_form(plant)
    law = ulna.state_feedback(form, ulna.LinearQuadratic())
    return _with(plant, law, saturation=Saturation(lower=-50.0, upper=50.0), delay=2e-3)
