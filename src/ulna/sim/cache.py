"""A bounded memory of what was prepared for a value, found by the identity of the value."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Any


class IdentityCache:
    """Remembers the last `size` results of a preparation, by the identity of an anchor and a hashable key.

    Hashing a plant walks all its formulas, which costs more than a simulation; comparing identities is free.
    The anchor is kept alive with its entry, so that its identity cannot come to mean another object.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._entries: OrderedDict[tuple[int, Hashable], tuple[object, Any]] = OrderedDict()
        self._lock = RLock()

    def get(self, anchor: object, key: Hashable, prepare: Callable[[], Any]) -> Any:
        """The prepared value, prepared now if it is not remembered."""
        full_key = (id(anchor), key)
        found = self._entries.get(full_key)
        if found is not None:
            return found[1]
        prepared = prepare()
        with self._lock:
            self._entries[full_key] = (anchor, prepared)
            while len(self._entries) > self._size:
                self._entries.popitem(last=False)
        return prepared
