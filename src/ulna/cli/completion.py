"""What the shell offers for a word begun: plants of the catalogue and files, questions of the analysis."""

from __future__ import annotations

from pathlib import Path

QUESTIONS = (
    "relative_degree",
    "relative_degree_at_point",
    "decoupling_matrix",
    "controllability_rank",
    "controllability_rank_at_point",
    "distribution_dims",
    "involutive",
    "full_state_linearizable",
    "linearizable_at_point",
    "state_linearizable",
    "linearizing_outputs",
    "T",
    "inverse",
    "control",
    "singular_set",
    "q_closed",
    "integrating_factor",
    "accessibility_rank",
    "observability_rank",
    "observability_rank_at_point",
    "observability_rank_without_inputs",
    "zero_dynamics",
    "minimum_phase",
    "observer_form",
    "observer_T",
    "observer_injection",
    "observer_form_output_transform",
    "output_transform",
    "dynamic_extension",
    "rest_points",
)
"""The keys of an analysis, here once more: the shell does not wait until `ulna.design` is loaded."""


def plant_names() -> list[str]:
    """The names of the catalogue, read from its folders alone: a shell does not wait for libraries."""
    from importlib.resources import files

    folders = (files("ulna") / "plants" / folder for folder in ("data", "textbook"))
    return sorted(entry.name.removesuffix(".toml") for place in folders for entry in place.iterdir())


def complete_plant(incomplete: str) -> list[str]:
    """Plants of the catalogue, plant files and folders that begin so."""
    return complete_plant_name(incomplete) + complete_file(incomplete)


def complete_plant_name(incomplete: str) -> list[str]:
    """Plants of the catalogue that begin so."""
    return [name for name in plant_names() if name.startswith(incomplete)]


def complete_file(incomplete: str) -> list[str]:
    """TOML and JSON files, and folders on the way to them."""
    folder, slash, begun = incomplete.rpartition("/")
    fitting = [e for e in Path(folder or slash or ".").glob("*") if e.name.startswith(begun)]
    kept = sorted(e for e in fitting if e.is_dir() or e.suffix in (".toml", ".json"))
    return [f"{folder}{slash}{e.name}{'/' if e.is_dir() else ''}" for e in kept]


def complete_question(incomplete: str) -> list[str]:
    """Keys of the analysis that begin so."""
    return [key for key in QUESTIONS if key.startswith(incomplete)]
