"""What the library says in Python's words, in the words of the terminal.

The table has what a command can meet. A remedy that is still Python after it is left out: no hint is better than one
that nobody can type.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from ulna.base import UlnaError, printable

_NUMBER = r"([-+.\w]+)"
_WORDS: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    # Hardware and limits.
    (r"Give Loop\(.*?hardware=Hardware\(period=[^)]*\)\)(?:, or engine=Taylor\(\.\.\.\))?\.", "Give --period 1e-3."),
    (rf"Hardware\((period|delay)={_NUMBER}\)", r"--\1 \2"),
    (rf"Saturation\(lower={_NUMBER}, upper={_NUMBER}\)", r"--limit \1:\2"),
    (rf"SlewLimit\(rate={_NUMBER}\)", r"--slew \1"),
    (rf"Jitter\(width={_NUMBER}\)", r"--jitter \1"),
    (rf"MissedSamples\(probability={_NUMBER}\)", r"--missed \1"),
    (rf"Deadline\(lateness={_NUMBER}\)", r"--lateness \1"),
    (rf"Deadline\(missed={_NUMBER}\)", r"--missed-most \1"),
    (r"Hardware\(references=\.\.\.\)", "--reference-range"),
    (rf"InnovationLimit\(\w+={_NUMBER}\)", r"--innovation, the number \1"),
    (rf"SafeOutput\({_NUMBER}\)", r"--safe-output \1"),
    (rf"Quantiser\(step={_NUMBER}\)", r"--resolution \1"),
    (rf"a quantiser of {_NUMBER} bits", r"--encoder \1"),
    (rf"MeasurementNoise\(std={_NUMBER}\)", r"--noise \1"),
    (rf"Pwm\((?:frequency|supply)={_NUMBER}\)", r"--pwm, the value \1"),
    (rf"EndStop\('(\w+)', {_NUMBER}, {_NUMBER}\)", r"--stop \1=\2:\3"),
    (r"Hardware\(end_stops=\.\.\.\)", "--stop"),
    (r"Give lower and upper of one EndStop\.", "Write both ends in one: theta=-1:1."),
    (rf"EndStop\(restitution={_NUMBER}\)", r"--stop, the rebound \1"),
    (r"Hardware\(saturation=\.\.\.\)", "--limit"),
    (r"Give the period too, Hardware\(period=1e-3, \.\.\.\) say\.", "Give --period 1e-3, say."),
    (r"Hardware\(period=\.\.\.\)", "--period"),
    (r"or Hardware\(\): a processor then", "or --period: a processor then"),
    (r"Leave Hardware\(saturation=\.\.\.\) out\.", "Leave --limit out."),
    (r"saturation=Saturation\(\.\.\.\)", "--limit"),
    (r"Pwm\([^)]*\) with pulses", "--pwm with pulses"),
    (r"Pwm\([^)]*\)", "--pwm"),
    # Values.
    (r"Give them: parameters=\{'(\w+)': \.\.\.\}(?:, or design for with_values\(\))?", r"Add --set \1=1, say"),
    (r"Give (?:them|it): inputs=\{'(\w+)': \.\.\.\}", r"Add --input \1=1, say"),
    (
        r"Use (?:plant\.)?with_values\(\)(?:, or give the values in its file)?\.",
        "Give values in the file, or add --set.",
    ),
    (r"(Give(?: both bounds:)?) Over\(parameters=\{'(\w+)': \(([^,]*), ([^)]*)\)\}\)", r"\1 --over \2=\3..\4"),
    (r"Build the loop from the plant before `with_values\(\)`\.", "Name a parameter of the plant."),
    (r"Claim UltimateBound\(\)", "Leave --global out"),
    (r"; without one ask for Region\(\) or StableWithin\(\)", ""),
    (r"State it: FixedPoint\(ranges=\{'(\w+)': \(([^,]*), ([^)]*)\)\}\)", r"State it: --range \1=\2:\3"),
    (r"Prove Region\(\) or StableWithin\(box=\{\.\.\.\}\)", "Leave --global out"),
    (r"Give StableWithin\(box=\{'(\w+)': ([\d.]+)\}\)", r"Give --within \1=\2"),
    # Engines.
    (
        r"Raise maximum_steps of the engine; if the system is stiff, engine=Implicit\(\)",
        "If it is stiff, --engine implicit",
    ),
    (r"Leave out FixedSteps\(number=\.\.\.\), sample faster,", "Sample faster,"),
    (r"; pip install 'ulna\[(\w+)\]' brings Implicit\(\) for it", r"; the extra [\1] brings --engine implicit for it"),
    (r"(\w+) of (Implicit|Taylor)\(\)", lambda m: f"{m[1].replace('_', ' ')} of --engine {m[2].lower()}"),
    (r"; integrated by Implicit\(\)", "; integrated by --engine implicit"),
    (r"Give engine=FixedSteps\(\.\.\.\), or leave it out\.", "Leave --engine out."),
    (r" ?throw=False returns the part before\.", ""),
    (r"ulna\.sim\.TIME", "t"),
    (r" \(ulna\.sim\.TIME\)", ""),
    (
        r"a formula in ulna\.TIME, a function of time, Held\(\.\.\.\) or Interpolated\(\.\.\.\)",
        "or a formula of the time t",
    ),
    # Design.
    (r"Give method=Method\.INPUT_OUTPUT to", "Add --input-output to"),
    (r"(?:Try|Use) `dynamic_extension`\.", "Add --extend."),
    (r"([Tt]ry|[Uu]se) `(?:input_output_form|normal_form)`", r"\1 --input-output"),
    (
        r"Use state_feedback\(plant, poles\), which takes the controller form by itself\.",
        "Leave --set-point and --track out.",
    ),
    (r"Give `outputs=` if you know them", "Choose others with --output if you know them"),
    (r"Leave the outputs out to have them found", "Choose others with --output"),
    (r"Give observer=HighGain\([^)]*\) or observer=KalmanNoise\(\)", "Give --high-gain 0.1 or --kalman"),
    (r"Use SetPoint\(\); Track\(\)", "Use --set-point; --track"),
    (r"state_weights=(.*?), input_weight=(.*?)\.(?=\s|$)", r"--lqr \1 : \2."),
    (
        r"`ulna\.substitute_input\(plant\)` makes (.*?) and `undo` turns the law back",
        r"`ulna design --substitute` makes \1 and turns the law back",
    ),
    (r", with `with_uses\(plant, controlled=\[…\]\)`", " with --output"),
    (r"with `with_uses\(plant, controlled=\[…\]\)`", "with --output"),
    (r", such as over=\{'(\w+)': \(([\d.]+), ([\d.]+), (\d+)\)\}", r": --schedule \1=\2:\3:\4"),
    (r"\bover= gives", "--schedule gives"),
    (r"Give catch=local_law\(\.\.\.\)", "Add --local and poles"),
    (r"\bwithin= gives", "--within gives"),
    (
        r"Read a plant file with `read_system`, take one of the catalogue with `model`.*",
        "Give a plant file or a name of the catalogue.",
    ),
    (r"`analyse`", "`ulna analyse`"),
    # Sweeps and exports.
    (r"Narrow them: .*", "Narrow them: uniform(0,5), normal(1,0.1,0.5,1.5)."),
    (rf"Saltelli\(base={_NUMBER}\)", r"--runs \1"),
    (r"Run a campaign with the plan Saltelli\([^)]*\)", "Run the sweep with --sampling indices"),
    (r"(Uniform|LogUniform)\(low=([^,]*), high=([^)]*)\)", lambda m: f"{m[1].lower()}({m[2]},{m[3]})"),
    (r"Normal\((?:mean|low)=([^,]*), (?:std|high)=([^)]*)\)", r"normal(\1,\2)"),
    (r"Give vary=\{.*?\}\)?\.", "Give --vary 'm2=uniform(0,5)'."),
    (r"settled_map\('(\w+)', '(\w+)', cells=[^)]*\)", r"--map \1,\2"),
    (r"sensitivity\([^)]*\)", "the Sobol indices"),
    (rf"sweep\(batch_size={_NUMBER}\)", r"--batch-size \1"),
    (r"DaskWorkers\(\)", "--scheduler"),
    (r"Give version=3 or version=2\.", "Give --fmi 3 or --fmi 2."),
    # Fits.
    (r'names=\{"([^"]*)": "([^"]*)"\}', r"--column \1=\2"),
    (r'units=\{"([^"]*)": "([^"]*)"\}', r"--unit \1=\2"),
    (r"\blost=True", "--lost"),
    (r"leave the parameter out of free=\[…\]", "leave the parameter out of --free"),
    (r"Leave it out of outputs=\[…\]", "Choose others with --measured"),
    (r"initial=\{…\}", "--initial"),
    (r"priors=\{…\}", "--prior"),
    (r"shooting=MultipleShooting\(\)", "--multiple-shooting"),
    (r"start=GlobalStart\(\)", "--global-start"),
    (r'inputs=\{"(\w+)": ([^}]*)\}', r"--input \1=\2"),
    # Recordings.
    (r"\brate=([.\d]+)", r"--rate \1"),
    (rf"\bmains={_NUMBER}", r"--mains \1"),
    (r"\benvelope=True", "--envelope"),
    (r"muscles=\('([^']*)'(?:, '([^']*)')?\)", r"--muscles '\1,\2'"),
)


_PYTHON = re.compile(
    r"\b[A-Za-z_.]+\([^()]*\b[a-z_]+=[^=]"  # a call with a keyword
    r"|\b(?:[A-Z][a-z]+){1,4}\("  # a constructor
    r"|\b[a-z]+_[a-z_]+\(|\b[a-z_]+\(\)"  # a function
    r"|\b[a-z_]+=(?:\{|\(|\.\.\.|True|False|None|[A-Z]\w*\()"  # an argument
    r"|`[a-z]+_[a-z_]+`|`[a-z_]+=`|\bulna\.[A-Za-z]"
)
"""What nobody can type at a terminal."""


def in_terminal_words(text: str) -> str:
    """The message with flags in place of Python's names."""
    for pattern, flag in _WORDS:
        text = re.sub(pattern, flag, text)
    return text


def is_python(text: str) -> bool:
    """Whether a text holds calls, constructors, arguments or modules of Python."""
    return _PYTHON.search(text) is not None


_BOUNDS = {"ge": "at least", "gt": "greater than", "le": "at most", "lt": "less than"}


def told(error: UlnaError) -> str:
    """An error for the terminal: what was asked, what was found, and what of the remedy can be typed."""
    asked, found = in_terminal_words(error.asked), in_terminal_words(error.found)
    hints = re.split(r"(?<=[.?]) (?=[A-Z`])", in_terminal_words(error.hint))
    kept = " ".join(hint for hint in hints if hint and not is_python(hint))
    return printable(f"{asked}: {found} {kept}".rstrip())


def mistyped(error: Any) -> UlnaError | None:
    """What is wrong with the value of an option, in the words of the terminal; None where nothing tells.

    Args:
        error: Typer's, caused by the failed validation, whose words are those of programmers.
    """
    if error.param is None or not hasattr(error.__cause__, "errors"):
        return None
    wrong = error.__cause__.errors()[0]
    given, limits = wrong.get("input"), wrong.get("ctx", {})
    kind = wrong["type"].partition("_")[0]
    found = {"float": "it is not a valid number.", "int": "it is not a valid whole number."}.get(kind)
    bound = next((f"{words} {limits[key]:g}" for key, words in _BOUNDS.items() if key in limits), None)
    if bound is not None:
        found = f"it must be {bound}."
    elif found is None:
        found = wrong["msg"].removeprefix("Value error, ").removeprefix(f"{given!r} ").rstrip(".")
        found = f"it {found}." if found.startswith("is ") else f"{found}."
    return UlnaError(f"{max(error.param.opts, key=len)} {given!r}", found)
