"""Muscles that a hand holds in the page: the chain of the study, sample by sample."""

from __future__ import annotations

import numpy as np
from scipy.signal import sosfilt

from ulna.plants import preset
from ulna.program import to_python
from ulna.studies.prosthesis.emg_pipeline import activations, calibrated, fresh_memory
from ulna.studies.prosthesis.emg_signal import SyntheticMuscles, shaping_sections, synthetic_recording
from ulna.studies.prosthesis.intent import IntentMemory, ProportionalSpeed, followable, read_intent
from ulna.studies.prosthesis.muscles import muscle_system
from ulna.studies.prosthesis.plant import bench_of
from ulna.symbolic.compiling import kernel


def test_the_system_is_the_chain_of_the_study() -> None:
    bench, muscles, count = bench_of(preset("transhumeral_elbow")), SyntheticMuscles(), 2500
    pipeline = calibrated(synthetic_recording(SyntheticMuscles(seed=9), np.ones(4000), np.ones(4000)))
    effort = np.zeros((count, 2))
    effort[200:900, 0], effort[1200:1700, 1] = 0.7, 0.8
    effort[1800:2300] = 0.9  # both: the other function is chosen
    white = np.random.default_rng(3).standard_normal((count, 4))
    white[0] = 0.0  # the pipeline takes its first sample as what has always been
    # The chain, each part over all samples.
    sections, gain = shaping_sections(muscles.rate)
    noise = np.asarray(sosfilt(sections, white, axis=0)) / gain
    pure = muscles.amplitude * effort * noise[:, :2]
    hum = muscles.hum * np.sin(2 * np.pi * muscles.hum_frequency * np.arange(count) / muscles.rate)
    raw = pure + muscles.crosstalk * pure[:, ::-1] + muscles.floor * noise[:, 2:] + hum[:, None]
    active, _ = activations(pipeline, raw, fresh_memory())
    speed = ProportionalSpeed(speed=bench.motion.speed)
    wish, _ = read_intent(speed, active, IntentMemory(), rate=muscles.rate, limits=bench.motion)
    wanted = followable(wish.position, 0.0, muscles.rate)
    assert wish.selected.max() == 1
    # The system, sample by sample.
    system = muscle_system(bench, muscles, pipeline)
    names = [s.name for s in (*system.states, *system.inputs)]
    outputs = {f"after {s.name}": e for s, e in zip(system.states, system.rates, strict=True)}
    outputs |= {s.name: e for s, e in zip(system.outputs, system.readouts, strict=True)}
    symbols = [s.symbol for s in (*system.states, *system.inputs)]
    run = to_python(
        kernel("muscles", symbols, outputs, definitions={d.symbol: d.expression for d in system.definitions})
    )
    memory, shown = [0.0] * len(system.states), np.empty((count, len(system.outputs)))
    for k in range(count):
        row = run(*memory, *effort[k], *white[k])
        memory, shown[k] = list(row[: len(memory)]), row[len(memory) :]
    found = dict(zip((s.name for s in system.outputs), shown.T, strict=True))
    assert len(names) == len(set(names))
    for name, values in {
        "emg_flexor": raw[:, 0], "emg_extensor": raw[:, 1], "activation_flexor": active[:, 0],
        "activation_extensor": active[:, 1], "y_ref": wanted[0], "y_ref_d1": wanted[1], "y_ref_d2": wanted[2],
    }.items():  # fmt: skip
        assert np.abs(found[name] - values).max() < 1e-9 * np.abs(values).max(), name
