"""Rows of numbers that are on the disk, not in memory, while a take grows."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from layfigure.errors import SpillError


class SpilledRows:
    """Equal rows in a file without a name, which is gone with the process however that ends.

    Rows are written at once, one system call each; none is kept in memory. Not thread-safe.
    """

    def __init__(self, dtype: DTypeLike, shape: tuple[int, ...] = (), folder: Path | None = None) -> None:
        """In `folder`, or in that of temporary files. Raises SpillError if there can be no file."""
        self._dtype = np.dtype(dtype)
        self._shape = shape
        self._row_bytes = self._dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        self._folder = folder if folder is not None else Path(tempfile.gettempdir())
        try:
            self._file = tempfile.TemporaryFile(buffering=0, dir=self._folder)  # noqa: SIM115, open as long as this is
        except OSError as error:
            raise self._failure(error.strerror) from error

    def put(self, index: int, row: object) -> None:
        """Raises SpillError if there is no room: the row is then not there, and those before it are."""
        data = np.asarray(row, self._dtype).tobytes()
        try:
            written = os.pwrite(self._file.fileno(), data, index * self._row_bytes)
        except OSError as error:
            raise self._failure(error.strerror) from error
        if written != len(data):
            raise self._failure("the disk is full")

    def rows(self, first: int, end: int) -> NDArray[Any]:
        """(end - first, *shape), of rows that were put: pages of the file, read when they are asked for."""
        shape = (end - first, *self._shape)
        if end == first or self._row_bytes == 0:
            return np.zeros(shape, self._dtype)
        mapped = np.memmap(self._file, self._dtype, mode="r", offset=first * self._row_bytes, shape=shape)
        return np.asarray(mapped)

    def _failure(self, reason: str | None) -> SpillError:
        return SpillError(f"cannot keep the take's poses in '{self._folder}': {reason}")
