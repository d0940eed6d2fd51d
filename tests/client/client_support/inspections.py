"""What layfigure-server --inspect would tell of a small doll, and a program that tells it."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import Any

CORNERS = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(low: list[float], high: list[float], first: int) -> tuple[list[list[float]], list[list[int]]]:
    corners = [[low[k] + corner[k] * (high[k] - low[k]) for k in range(3)] for corner in CORNERS]
    triangles = [[first + i for i in t] for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))]
    return corners, triangles


def make_description() -> dict[str, Any]:
    """A box 1 m high on another one; the section between them is a square, the lower one has none."""
    lower, lower_triangles = box([-0.2, -0.2, 0.0], [0.2, 0.2, 1.0], 0)
    upper, upper_triangles = box([-0.2, -0.2, 1.0], [0.2, 0.2, 2.0], 8)
    square = [[-0.2, -0.2, 1.0], [0.2, -0.2, 1.0], [0.2, 0.2, 1.0], [-0.2, 0.2, 1.0]]
    axes = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.6]]
    return {
        "name": "boxes",
        "source_file": "boxes.glb",
        "settings": {"source": None},
        "mass": 3.0,
        "bodies": [{"name": "lower", "mass": 1.0}, {"name": "upper", "mass": 2.0}],
        "geometry": {
            "vertices": lower + upper,
            "triangles": lower_triangles + upper_triangles,
            "body_of_triangle": [0] * 12 + [1] * 12,
            "bodies": [
                {"com": [0.0, 0.0, 0.5], "semi_axes": axes, "section": []},
                {"com": [0.0, 0.0, 1.5], "semi_axes": axes, "section": square},
            ],
        },
    }


def write_program(path: Path, output: str, remark: str = "", exit_code: int = 0) -> Path:
    """A program in the place of layfigure-server, which prints `output` and, on stderr, `remark` and its arguments."""
    script = path.with_name(path.name + ".py")
    script.write_text(
        f"import sys\nsys.stdout.write({output!r})\n"
        f"sys.stderr.write({remark!r})\nopen({str(path) + '.arguments'!r}, 'w').write(repr(sys.argv[1:]))\n"
        f"sys.exit({exit_code})\n"
    )
    # The shell starts it: a first line that names the interpreter cannot have a space in its path.
    path.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(script))} "$@"\n')
    path.chmod(0o755)
    return path


def write_inspector(path: Path, remark: str = "") -> Path:
    return write_program(path, json.dumps(make_description()), remark)
