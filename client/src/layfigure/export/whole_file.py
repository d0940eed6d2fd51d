"""Files that are whole or not there."""

from __future__ import annotations

from pathlib import Path

from layfigure.errors import LayfigureError


def write_whole(out: Path, data: bytes) -> None:
    """Under another name first. Raises LayfigureError if it cannot be written."""
    partial = out.with_name(f".{out.name}.partial")
    try:
        partial.write_bytes(data)
        partial.replace(out)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
