"""What a check finds: rules that are broken, and what USD allows but importers or players may stumble over."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    where: str  # a prim, a property (with its frame) or a layer
    what: str
    is_error: bool

    def __str__(self) -> str:
        return f"{'error' if self.is_error else 'warning'}: {self.where}: {self.what}"


def error(where: object, what: str) -> Finding:
    """A rule of USD's is broken: the skeleton, its animation or its skin is not what was meant."""
    return Finding(str(where), what, is_error=True)


def warning(where: object, what: str) -> Finding:
    """USD allows it. In a take of Layfigure's own it is an error, as the recorder never does it."""
    return Finding(str(where), what, is_error=False)
