"""layfigure inspect with the real server on a real character."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from e2e_support import RunClient
from PIL import Image


def test_inspect_draws_the_doll_of_a_character(
    binary: Path, character: Path, client: RunClient, tmp_path: Path
) -> None:
    result = client("inspect", character, "-o", "doll.png", "--server-program", binary)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("doll.png: 17 bodies, ")
    picture = np.asarray(Image.open(tmp_path / "doll.png").convert("RGB")).astype(int)
    chroma = np.ptp(picture[100:900, :800], axis=2)
    assert (chroma > 60).mean() > 0.03  # bodies in colours, on a grey ground


def test_inspect_uses_the_settings_beside_the_character_and_says_so(
    binary: Path, character: Path, client: RunClient, tmp_path: Path
) -> None:
    own = Path(shutil.copy(character, tmp_path / "doll.glb"))
    (tmp_path / "doll.doll.toml").write_text("total_mass = 7.5\n")
    result = client("inspect", own, "-o", "doll.png", "--server-program", binary)
    assert result.returncode == 0
    assert "using the settings beside the character" in result.stderr
    assert result.stdout == "doll.png: 17 bodies, 7.5 kg\n"


def test_inspect_bad_character_fails_in_one_line(binary: Path, client: RunClient, tmp_path: Path) -> None:
    result = client("inspect", "none.glb", "-o", "doll.png", "--server-program", binary)
    assert result.returncode == 1
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("layfigure: ")
    assert "none.glb" in result.stderr
    assert not (tmp_path / "doll.png").exists()
