"""What the shell offers for a word begun: plants of the catalogue and files, questions of the analysis."""

from __future__ import annotations

from pathlib import Path


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
    from ulna.design.analysis.formula_answers import GROUPS

    return [key for group in GROUPS for key in group if key.startswith(incomplete)]
