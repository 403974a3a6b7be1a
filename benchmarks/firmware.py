"""The paper's compensator as C on a Cortex-M4F and here: ulna's, CasADi's, one written by hand, ulna's law with newlib.

Law and observer in single precision, the observer by Euler's rule at 1 kHz, ±24 V. All contenders stand behind the same
header and see the same 2000 measured angles, so that a call of one is a call of the other. Instructions are counted on
QEMU's model of the processor by `ulna.deploy`; code is what the linked program grows by, with the functions of newlib
that are called. The error is the largest difference of a command from the step in double precision. CasADi's C is
repaired by hand: asked for float it calls the functions of double precision.

    python benchmarks/firmware.py [--rounds 7]
"""

from __future__ import annotations

import argparse
import ctypes
import re
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import ulna
from ulna import Hardware, Loop, Plain, Quantiser, Saturation
from ulna.deploy import TARGETS, Cost, c_project, firmware
from ulna.deploy.emulation import cost_of
from ulna.deploy.library import library
from ulna.loop import Euler
from ulna.program import Fused, Precision, Unwritten

NAME, TARGET, SAMPLES = "arm", TARGETS["cortex-m4f"], 2000


def paper_loop(arithmetic: Any, **more: Any) -> Loop:
    plant = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2 + 3.46j, -2 - 3.46j, -8))
    observer = ulna.exact_observer(ulna.observer_form(plant), ulna.Poles(-9, -10, -11))
    named = {"guard": None, "saturation": Saturation(lower=-24, upper=24), "discretisation": Euler(), **more}
    hardware = Hardware(period=1e-3, arithmetic=arithmetic, **named)
    return Loop(plant=plant, controller=ulna.compensator(law, observer), hardware=hardware)


def with_init(step: str) -> str:
    """The text of a step, with the `init` that goes before it."""
    return f"""#include "{NAME}.h"
#include <math.h>
void {NAME}_init({NAME}_memory *memory)
{{
    const {NAME}_memory nothing = {{0}};
    *memory = nothing;
}}
{step}"""


BY_HAND = with_init(f"""
void {NAME}_step({NAME}_memory *memory, const {NAME}_input *input, {NAME}_output *output)
{{
    const float a = memory->state_theta_hat, w = memory->state_omega_hat, i = memory->state_i_hat;
    const float e = input->y - a;
    float u = 1.764f * w * sinf(a) - 1.4465516f * w - 6.5164127f * a - 21.168f * cosf(a) - 0.2f * i;
    u = (u > 24.0f) ? 24.0f : ((u < -24.0f) ? -24.0f : u);
    memory->state_theta_hat = a + 0.001f * (w + 20.0f * e);
    memory->state_omega_hat = w + 0.001f * (1.9607843f * i + 34.588235f * cosf(input->y) + 79.39216f * e);
    memory->state_i_hat = i + 0.001f * (10.0f * (u - w - i) - 100.0f * e);
    output->u = u;
    output->theta_hat = a;
    output->omega_hat = w;
    output->i_hat = i;
    output->fault = 0;
}}
""")


def by_casadi() -> str:
    """CasADi's C of the same step, called as it wants to be."""
    z, y = ca.SX.sym("z", 3), ca.SX.sym("y")
    a, w, i = z[0], z[1], z[2]
    u = 1.764 * w * ca.sin(a) - 1.4465516 * w - 6.5164127 * a - 21.168 * ca.cos(a) - 0.2 * i
    u, e = ca.fmin(ca.fmax(u, -24.0), 24.0), y - a
    rates = [w + 20 * e, 1.9607843 * i + 34.588235 * ca.cos(y) + 79.39216 * e, 10 * (u - w - i) - 100 * e]
    step = ca.Function("of_casadi", [z, y], [z + 1e-3 * ca.vertcat(*rates), u])
    made = ca.CodeGenerator("of_casadi", {"casadi_real": "float", "with_header": False})
    made.add(step)
    text = re.sub(r"\b(sin|cos)\(", r"\1f(", made.dump())  # repaired
    text = (
        re.sub(r"return ([xy<>?: ]*);", lambda found: found[0], text)
        .replace("fmin(", "fminf(")
        .replace("fmax(", "fmaxf(")
    )
    return with_init(f"""{text}
void {NAME}_step({NAME}_memory *memory, const {NAME}_input *input, {NAME}_output *output)
{{
    const float given[3] = {{memory->state_theta_hat, memory->state_omega_hat, memory->state_i_hat}};
    float next[3];
    const float *arg[2] = {{given, &input->y}};
    float *res[2] = {{next, &output->u}};
    (void)of_casadi(arg, res, 0, 0, 0);
    memory->state_theta_hat = next[0];
    memory->state_omega_hat = next[1];
    memory->state_i_hat = next[2];
    output->theta_hat = given[0];
    output->omega_hat = given[1];
    output->i_hat = given[2];
    output->fault = 0;
}}
""")


def here(folder: Path, rows: np.ndarray, rounds: int) -> tuple[np.ndarray, float]:
    """(N,) commands of the C in a folder, and ns of CPU time a call on this machine."""
    harness = f"""
void replay(int count, const float *given, float *answer)
{{
    {NAME}_memory memory;
    {NAME}_input input;
    {NAME}_output output;
    {NAME}_init(&memory);
    for (int k = 0; k < count; k++)
    {{
        input.y = given[k];
        {NAME}_step(&memory, &input, &output);
        answer[k] = output.u;
    }}
}}
"""
    run = library(folder, NAME, harness, "cc").replay
    run.argtypes, run.restype = [ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p], None
    given, answer, spent = np.ascontiguousarray(rows[:, 0], np.float32), np.zeros(len(rows), np.float32), []
    for _ in range(rounds):
        began = time.process_time_ns()
        for _ in range(100):
            run(len(rows), given.ctypes.data, answer.ctypes.data)
        spent.append((time.process_time_ns() - began) / 100 / len(rows))
    return answer, statistics.median(spent)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--rounds", type=int, default=7)
    rounds = options.parse_args().rounds
    run = ulna.simulate(paper_loop(Plain()), {"theta": 1.0, "omega": 0.0, "i": 0.0}, SAMPLES * 1e-3)
    rows = np.asarray(run["y_measured"])[:SAMPLES, None]
    base = paper_loop(Plain())
    guarded = {"guard": Hardware().guard, "sensors": Quantiser.encoder(bits=12)}
    contenders: dict[str, Loop | str] = {
        "ulna, Plain: the same bits everywhere": base,
        "ulna, Fused": paper_loop(Fused()),
        "ulna's law with newlib": paper_loop(Unwritten()),
        "CasADi, float repaired": by_casadi(),
        "by hand": BY_HAND,
        "ulna, Plain, with guard and encoder": paper_loop(Plain(), **guarded),
    }
    found: dict[str, tuple[Cost, float, float]] = {}
    with tempfile.TemporaryDirectory() as work:
        for k, (name, kind) in enumerate(contenders.items()):
            folder = Path(work) / f"{k}"
            c_project(base if isinstance(kind, str) else kind, folder, name=NAME, target=TARGET)
            source = folder / f"{NAME}.c"
            if isinstance(kind, str):
                source.write_text(kind)
            answer, spent = here(folder, rows, rounds)
            exact = firmware(base if isinstance(kind, str) else kind, precision=Precision.DOUBLE).run(rows)[:, 0]
            found[name] = cost_of(folder, NAME, TARGET, step=source), float(np.abs(answer - exact).max()), spent
    first, _, fastest = found[next(iter(found))]
    print("| contender | instructions a call | ratio | bytes of code | stack | error, V | ns a call here | ratio |")
    print("|---|---|---|---|---|---|---|---|")
    for name, (cost, error, spent) in found.items():
        code = first.code + cost.program - first.program
        ratio = cost.instructions / first.instructions
        print(
            f"| {name} | {cost.instructions:.0f} | {ratio:.2f} | {code} | {cost.stack} "
            f"| {error:.1g} | {spent:.1f} | {spent / fastest:.2f} |"
        )


if __name__ == "__main__":
    main()
