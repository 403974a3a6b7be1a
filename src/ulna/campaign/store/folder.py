"""A folder that holds a campaign: a manifest, and one file for each batch that is done.

A batch lands under its final name by a rename, after its bytes have reached the disk, and its name carries a
fingerprint of its contents. Whatever stands under such a name is therefore whole, or is found out: the folder can be
left at any moment, by SIGKILL or power cut, and taken up again.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ulna.base import lock_alone, whole_file
from ulna.campaign.errors import CampaignError
from ulna.campaign.store.batch_file import fingerprint
from ulna.campaign.store.library_versions import check_versions
from ulna.campaign.store.store import Batch, Manifest, Store

MANIFEST = "campaign.json"
BATCHES = "batches"
LOCK = ".lock"

_BATCH = re.compile(r"(\d{13})-(\d{13})\.([0-9a-f]{32})\.nc")
_LEFTOVER = re.compile(r"\.[0-9a-f]{32}\.part")


class FolderStore(Store):
    """A store on disk; `open_folder` and `claimed` make it.

    Args:
        path: the folder.
        manifest: what stands in it.
    """

    def __init__(self, path: Path, manifest: Manifest) -> None:
        super().__init__(manifest)
        self.path = path
        allowed = set(manifest.batches)
        self._names: dict[Batch, str] = {}
        for name in _listed(path / BATCHES):
            match = _BATCH.fullmatch(name)
            if match and (batch := (int(match[1]), int(match[2]))) in allowed:
                self._names[batch] = name

    def done(self) -> set[Batch]:
        """The batches that are there; each was whole when it was written."""
        return set(self._names)

    def put(self, batch: Batch, data: bytes) -> None:
        """Write a batch: it is there whole or not at all.

        Raises:
            CampaignError: a disk that is full or cannot be written; batches that are there stay.
        """
        name = f"{batch[0]:013d}-{batch[1]:013d}.{fingerprint(data)}.nc"
        try:
            with whole_file(self.path / BATCHES / name) as file:
                file.write(data)
        except OSError as error:
            raise CampaignError(
                f"the result folder '{self.path}'",
                f"a batch cannot be written: {(error.strerror or str(error)).lower()}; "
                f"{self.runs_done} of {self.manifest.runs} runs are safe in it.",
                "Make room, then start the same campaign again: it goes on from there.",
            ) from error
        self._names[batch] = name

    def get(self, batch: Batch) -> bytes:
        """The bytes of a batch.

        Raises:
            CampaignError: a batch that is missing, truncated or altered.
        """
        name = self._names.get(batch)
        if name is None:
            raise CampaignError(
                f"the result folder '{self.path}'", f"runs {batch[0]} to {batch[1] - 1} are not there yet."
            )
        try:
            data = (self.path / BATCHES / name).read_bytes()
        except OSError as error:
            raise _unreadable(self.path, error) from error
        if fingerprint(data) != name.split(".")[1]:
            raise CampaignError(
                f"the result folder '{self.path}'",
                f"the batch '{BATCHES}/{name}' is truncated or altered.",
                "Start the same campaign again: it computes that batch anew.",
            )
        return data

    def drop_damaged(self) -> int:
        """Remove batches whose bytes are not what was written; how many."""
        damaged = 0
        for batch in sorted(self._names):
            try:
                self.get(batch)
            except CampaignError:
                (self.path / BATCHES / self._names.pop(batch)).unlink(missing_ok=True)
                damaged += 1
        return damaged


@contextmanager
def claimed(path: Path, wanted: Manifest) -> Iterator[FolderStore]:
    """The folder for a campaign, kept from other processes: a new one, or the one in which it was begun.

    A campaign that was begun there and of which no batch is done gives way: nothing is lost with it.

    Raises:
        CampaignError: a folder that holds something else, was begun with other libraries, cannot be written, or on
            which another process is at work.
    """
    try:
        _check_free(path)
        (path / BATCHES).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(path, error) from error
    with locked(path):
        found = open_folder(path) if (path / MANIFEST).is_file() else None
        if found is not None and found.manifest.settings != wanted.settings and found.done():
            raise _other_campaign(path, found.manifest, wanted)
        if found is not None and found.done():
            check_versions(found.manifest.versions, f"the result folder '{path}'")
        else:
            found = FolderStore(path, wanted)
            try:
                with whole_file(path / MANIFEST) as file:
                    file.write(wanted.to_text().encode())
            except OSError as error:
                raise _unwritable(path, error) from error
            _remember_names(path)
        yield found
        # Once is enough, and saves half of the time for writing: a batch that a power cut takes back is computed anew.
        _remember_names(path / BATCHES)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep a second process from working on a folder; the lock ends with the process, however that ends.

    Raises:
        CampaignError: where another process is at work, or nothing can be written.
    """
    try:
        handle = os.open(path / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise _unwritable(path, error) from error
    try:
        if not lock_alone(handle):
            raise CampaignError(
                f"the result folder '{path}'", "another process is using it.", "Wait for it, or end it."
            )
        for place in (path, path / BATCHES):
            for name in _listed(place):
                if _LEFTOVER.fullmatch(name):
                    (place / name).unlink(missing_ok=True)
        yield
    finally:
        os.close(handle)


def _check_free(path: Path) -> None:
    """Refuse a place that is not this campaign's to write to."""
    if path.exists() and not path.is_dir():
        raise CampaignError(f"the result folder '{path}'", "there is a file of this name.", "Give another folder.")
    if (path / MANIFEST).is_file():
        return
    # A process killed early leaves `batches` or the lock and no manifest; nothing else may be there.
    strange = [name for name in _listed(path) if name not in (BATCHES, LOCK) and not _LEFTOVER.fullmatch(name)]
    if strange or _listed(path / BATCHES):
        raise CampaignError(
            f"the result folder '{path}'",
            f"it holds files that do not belong to a campaign ({', '.join((strange or [BATCHES])[:3])}).",
            "Give an empty or a new folder.",
        )


def open_folder(path: Path) -> FolderStore:
    """The campaign in a folder.

    Raises:
        CampaignError: where there is none, or its manifest cannot be read.
    """
    try:
        data: Any = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CampaignError(f"the result folder '{path}'", f"there is no {MANIFEST} in it.") from None
    except OSError as error:
        raise _unreadable(path, error) from error
    except (ValueError, RecursionError) as error:
        raise CampaignError(f"'{path / MANIFEST}'", f"it is truncated or not JSON ({error}).") from None
    try:
        return FolderStore(path, Manifest.from_mapping(data))
    except (KeyError, TypeError, ValueError) as error:
        raise CampaignError(f"'{path / MANIFEST}'", f"it is not the manifest of a campaign ({error}).") from None


def _remember_names(folder: Path) -> None:
    """Bring the names in a folder to the disk: without that a power cut may take back the latest files, each whole."""
    if os.name != "posix":
        return  # elsewhere a folder cannot be opened
    try:
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
    except OSError as error:
        raise _unwritable(folder, error) from error


def _other_campaign(path: Path, found: Manifest, wanted: Manifest) -> CampaignError:
    differing = _differing(json.loads(found.settings), json.loads(wanted.settings))
    return CampaignError(
        f"the result folder '{path}'",
        f"it holds another campaign; other there: {', '.join(differing[:4]) or 'settings'}.",
        "Give another folder, or the same settings to go on.",
    )


def _differing(theirs: Any, ours: Any, where: str = "") -> list[str]:
    """Where two settings part, with the values as far as they are short."""
    if isinstance(theirs, dict) and isinstance(ours, dict) and theirs.get("type") == ours.get("type"):
        found = []
        for key in ours:
            if theirs.get(key) != ours[key]:
                found += _differing(theirs.get(key), ours[key], f"{where}.{key}".lstrip("."))
        return found
    if isinstance(theirs, int | float | str) and isinstance(ours, int | float | str):
        return [f"{where} ({str(theirs)[:30]}, not {str(ours)[:30]})"]
    return [where]


def _listed(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir()) if folder.is_dir() else []


def _unwritable(path: Path, error: OSError) -> CampaignError:
    reason = (error.strerror or str(error)).lower()
    return CampaignError(f"the result folder '{path}'", f"it cannot be written: {reason}.", "Give another one.")


def _unreadable(path: Path, error: OSError) -> CampaignError:
    return CampaignError(f"the result folder '{path}'", f"it cannot be read: {(error.strerror or str(error)).lower()}.")
