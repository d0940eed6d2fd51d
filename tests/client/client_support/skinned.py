"""Takes compared as USD itself skins them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from layfigure.usd.reader import SkinnedStage


def farthest_by_usd(first: Path, second: Path) -> float:
    """Over every vertex and frame of two takes, each skinned by UsdSkel [m]."""
    one, other = SkinnedStage(first), SkinnedStage(second)
    assert one.last_frame == other.last_frame
    return max(
        float(np.linalg.norm(a.points - b.points, axis=1).max())
        for frame in np.arange(one.first_frame, one.last_frame + 1.0)
        for a, b in zip(one.posed(frame), other.posed(frame), strict=True)
    )
