"""`make release VERSION=0.2.0`: the changelog from its fragments, the wheel tried outside the tree, a commit and a tag.

Nothing is published. Until the wheel has passed nothing is committed; `git restore .` takes the rest back.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import venv
from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
KINDS = {"added": "Added", "changed": "Changed", "fixed": "Fixed", "removed": "Removed"}
VERSIONED = {"src/ulna/__init__.py": r'^__version__ = "(.+)"$', "CITATION.cff": r"^version: (.+)$"}
TRIED = (["ulna", "--version"], ["ulna", "analyse", "duffing"], ["ulna", "reproduce", "--out", "reproduction"])


def read_fragments(folder: Path) -> dict[str, list[str]]:
    """What each fragment says, by kind, in order of its file's name: a sentence or two, or a list of them."""
    found: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for path in sorted(folder.glob("*.*.md")):
        kind = path.name.split(".")[-2]
        if kind not in found:
            raise SystemExit(f"{path.name}: '{kind}' is not a kind of change. Known: {', '.join(KINDS)}.")
        items = re.split(r"^- ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        found[kind] += [" ".join(item.split()) for item in items if item.strip()]
    return found


def section(version: str, day: date, fragments: Mapping[str, Sequence[str]]) -> str:
    """The part of the changelog about one version."""
    parts = [f"## {version} ({day.isoformat()})"]
    for kind, title in KINDS.items():
        if fragments[kind]:
            parts += [f"### {title}", "\n".join(f"- {sentence}" for sentence in fragments[kind])]
    return "\n\n".join(parts) + "\n"


def with_section(changelog: str, new: str) -> str:
    """The changelog with a section before those of older versions."""
    head, mark, older = changelog.partition("\n## ")
    return f"{head.rstrip()}\n\n{new}" + (f"\n## {older}" if mark else "")


def newer(version: str, current: str) -> bool:
    """Whether a version like 0.2.0 comes after another."""
    return [int(n) for n in version.split(".")] > [int(n) for n in current.split(".")]


def _written(place: Path, version: str, pattern: str) -> str:
    given = place.read_text(encoding="utf-8")
    text, count = re.subn(pattern, lambda m: m[0].replace(m[1], version), given, flags=re.MULTILINE)
    if count != 1:
        raise SystemExit(f"{place}: expected one line that holds the version, found {count}.")
    return text


def _try_wheel(wheel: Path) -> None:
    """Install the wheel with the pins into a fresh environment and use it in an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(Path(folder) / "venv", with_pip=True)
        programs = Path(folder) / "venv" / "bin"
        pins = ROOT / "requirements" / "base.txt"
        subprocess.run([programs / "python", "-m", "pip", "install", "--quiet", "-c", pins, wheel], check=True)
        for program, *arguments in TRIED:
            subprocess.run([programs / program, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def main(version: str) -> None:
    """Do all of it.

    Raises:
        SystemExit: for a version that is not newer, or a tree with changes of its own.
    """
    front = "src/ulna/__init__.py"
    current = re.search(VERSIONED[front], (ROOT / front).read_text(encoding="utf-8"), flags=re.MULTILINE)
    if not re.fullmatch(r"\d+\.\d+\.\d+", version) or current is None or not newer(version, current[1]):
        raise SystemExit(f"VERSION '{version}': expected one like 1.2.3 above {current and current[1]}.")
    if _git("status", "--porcelain"):
        raise SystemExit("the tree has changes that are not committed. Commit them first.")
    fragments = ROOT / "changelog.d"
    new = section(version, datetime.now(UTC).date(), read_fragments(fragments))
    log = ROOT / "CHANGELOG.md"
    log.write_text(with_section(log.read_text(encoding="utf-8"), new), encoding="utf-8")
    for path in fragments.glob("*.*.md"):
        path.unlink()
    for place, pattern in VERSIONED.items():
        (ROOT / place).write_text(_written(ROOT / place, version, pattern), encoding="utf-8")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", "dist", "."]
    subprocess.run(build, cwd=ROOT, check=True)
    _try_wheel(next((ROOT / "dist").glob(f"ulna-{version}-*.whl")))
    _git("add", "--all")
    _git("commit", "--quiet", "--message", f"Version {version}")
    _git("tag", "--annotate", f"v{version}", "--message", f"Version {version}")
    print(f"{version} is committed and tagged; its wheel lies in dist/.")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "")
