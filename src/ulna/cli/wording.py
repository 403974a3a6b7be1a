"""What the library says in Python's words, in the words of the terminal."""

from __future__ import annotations

import re

_NUMBER = r"([-+.\w]+)"
_WORDS: tuple[tuple[str, str], ...] = (
    # Hardware and limits.
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
    # Design.
    (r"Give method=Method\.INPUT_OUTPUT to", "Add --input-output to"),
    (r"Try `dynamic_extension`\.", "Add --extend."),
    (r"([Tt]ry|Use) `input_output_form`", r"\1 --input-output"),
    (r"`analyse`", "`ulna analyse`"),
    # Sweeps.
    (r"Narrow them: .*", "Narrow them: uniform(0,5), normal(1,0.1,0.5,1.5)."),
    (rf"Saltelli\(base={_NUMBER}\)", r"--runs \1"),
    (rf"sweep\(batch_size={_NUMBER}\)", r"--batch-size \1"),
    (r"DaskWorkers\(\)", "--scheduler"),
    # Recordings.
    (r"\brate=([.\d]+)", r"--rate \1"),
    (rf"\bmains={_NUMBER}", r"--mains \1"),
    (r"\benvelope=True", "--envelope"),
    (r"muscles=\('([^']*)'(?:, '([^']*)')?\)", r"--muscles '\1,\2'"),
)


def in_terminal_words(text: str) -> str:
    """The message with flags in place of Python's names."""
    for pattern, flag in _WORDS:
        text = re.sub(pattern, flag, text)
    return text


def evidence_label(key: str) -> str:
    """What stands before a piece of evidence."""
    words = {"fails": "what fails", "open": "what is open", "ran_out": "the time ran out"}
    return words.get(key, key.replace("_", " "))
