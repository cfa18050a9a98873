"""arrays, index -> arrays.  Columns of points or paths that are gathered when they are read.

Of a few hundred bytes that a path carries, a step reads some and most paths end soon: what nobody
reads is never copied.
"""

from typing import Any

import numpy as np

from ..arrays import Index


class Lazy:
    """Points or paths at `index` (n,), or all of them: the same fields, read one by one."""

    def __init__(self, whole: Any, index: Index | None) -> None:
        self._whole, self._index = whole, index

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._whole, name)
        if self._index is not None and isinstance(found, np.ndarray):
            found = found.take(self._index, axis=-1)
        setattr(self, name, found)
        return found

    @property
    def size(self) -> int:
        """The number of columns."""
        return int(self._whole.size) if self._index is None else self._index.size

    @property
    def slot(self) -> Index | None:
        """The slots of paths (n,); those of all are implied, None, of some explicit."""
        slot: Index | None = self._whole.slot
        if self._index is None:
            return slot
        return self._index if slot is None else slot.take(self._index)

    def take(self, index: Index) -> "Lazy":
        """Return the columns at `index` (m,) of these."""
        return Lazy(self._whole, index if self._index is None else self._index.take(index))
