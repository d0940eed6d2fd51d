"""Files that threads write: no bpy."""

from __future__ import annotations

from pathlib import Path


def write_settings(text: str, _program: Path, character: Path) -> None:
    character.with_suffix(".doll.toml").write_text(text, encoding="utf-8")
