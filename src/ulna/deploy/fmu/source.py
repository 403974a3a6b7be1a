"""The C of an FMU: slots, kernels as functions over them, the time, and the two interfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files

from ulna.deploy.fmu.part import Model
from ulna.loop import Repeat
from ulna.program import Kernel, Operation, Precision, bound, c_header, c_literal, c_statements

_GENERATED = "/* Written by ulna; do not edit. Design {}. */\n"


_TYPES = """enum { INPUT, OUTPUT, PARAMETER, LOCAL };
typedef struct { int slot; int kind; int flag; double start; } variable;
"""


def sources(model: Model, version: int, token: str) -> dict[str, str]:
    """Name → text of the files of C.

    Args:
        model: what is computed. version: of FMI, 2 or 3. token: that an importer has to show.
    """
    place = files("ulna.deploy.fmu") / "templates"
    read = {name: (place / name).read_text(encoding="utf-8") for name in ("time.c", f"fmi{version}.c")}
    head = _GENERATED.format(model.fingerprint)
    return {
        "model.h": head + (place / "model.h").read_text(encoding="utf-8"),
        "model.c": head + _model(model, token) + read["time.c"],
        f"fmi{version}.c": head + read[f"fmi{version}.c"],
    }


def _model(model: Model, token: str) -> str:
    """Slots, table of variables, kernels and programs."""
    programs = {"sample": model.sample, "motion": model.motion, "shown": model.shown}
    programs["begin"] = () if model.begin is None else (model.begin,)
    kernels = [each for program in programs.values() for each in _kernels(program)]
    kernels = [bound(each, model.numbers) for each in dict.fromkeys(kernels)]
    named = dict(
        zip(dict.fromkeys(e for program in programs.values() for e in _kernels(program)), kernels, strict=True)
    )
    slots = list(dict.fromkeys(n for each in kernels for n in (*each.inputs, *each.outputs)))
    slots += [n for v in model.variables for n in (v.slot, *v.further) if n not in slots]
    place = {name: k for k, name in enumerate(dict.fromkeys([*slots, "time", "span"]))}
    flips = any(Operation.FLIP in each.operations for each in kernels)
    lines = [
        '#include "model.h"\n#include <stdlib.h>\n',
        c_header(Precision.DOUBLE, flips=flips),
        f"#define SLOTS {len(place)}\n#define TIME {place['time']}\n#define SPAN {place['span']}\n",
        f"#define PERIOD {c_literal(model.period, Precision.DOUBLE)}\n",
        f"#define SAMPLED {int(model.sampled)}\n#define DENSE {int(model.dense)}\n",
        f"#define VARIABLES {len(model.variables)}\n",
        f'const char *const model_token = "{token}";\n',
        _TYPES,
        _table(model, place),
    ]
    for k, each in enumerate(kernels):
        lines.append(_function(each, f"kernel_{k}", place))
    functions = {each: f"kernel_{k}" for k, each in enumerate(kernels)}
    for name, program in programs.items():
        body = _program(program, {each: functions[named[each]] for each in _kernels(program)}, model.numbers, "    ")
        lines.append(f"static void {name}(double *s)\n{{\n    (void)s;\n{body}}}\n")
    return "\n".join(lines)


def _table(model: Model, place: Mapping[str, int]) -> str:
    kinds = {"input": "INPUT", "output": "OUTPUT", "parameter": "PARAMETER", "local": "LOCAL"}
    rows = "".join(
        f"    {{{place[v.slot]}, {kinds[v.causality]}, {int(v.flag)}, {c_literal(v.start, Precision.DOUBLE)}}},\n"
        for v in model.variables
    )
    pairs = [(place[v.slot], place[name]) for v in model.variables for name in v.further if name in place]
    further = "".join(f"    {{{a}, {b}}},\n" for a, b in pairs) + "    {0, 0}\n"
    return (
        f"static const variable variables[VARIABLES] = {{\n{rows}}};\n"
        f"/* Slots that begin with the value of another one. */\nstatic const int alike[][2] = {{\n{further}}};\n"
        f"#define ALIKE {len(pairs)}\n"
    )


def _kernels(program: Sequence[Kernel | Repeat]) -> list[Kernel]:
    found: list[Kernel] = []
    for each in program:
        found += _kernels(each.body) if isinstance(each, Repeat) else [each]
    return found


def _function(kernel: Kernel, name: str, place: Mapping[str, int]) -> str:
    """All inputs are read before the first output is written."""
    locals_ = [f"i{k}" for k in range(len(kernel.inputs))]
    used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
    lines = [f"const double i{k} = s[{place[slot]}];" for k, slot in enumerate(kernel.inputs) if k in used]
    lines = lines or ["(void)s;"]
    pairs, results = c_statements(kernel, locals_, precision=Precision.DOUBLE)
    lines += [f"const double {target} = {text};" for target, text in pairs]
    lines += [f"s[{place[slot]}] = {text};" for slot, text in zip(kernel.outputs, results, strict=True)]
    return f"static void {name}(double *s)\n{{\n" + "".join(f"    {line}\n" for line in lines) + "}\n"


def _program(
    program: Sequence[Kernel | Repeat], functions: Mapping[Kernel, str], numbers: Mapping[str, float], indent: str
) -> str:
    text = ""
    for each in program:
        if isinstance(each, Repeat):
            text += (
                f"{indent}for (int n{len(indent)} = 0; n{len(indent)} < {int(numbers[each.times])}; n{len(indent)}++)\n"
            )
            text += f"{indent}{{\n{_program(each.body, functions, numbers, indent + '    ')}{indent}}}\n"
        else:
            text += f"{indent}{functions[each]}(s);\n"
    return text
