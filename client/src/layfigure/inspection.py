"""What layfigure-server --inspect tells of the doll that it would build of a character."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from layfigure.errors import LayfigureError, ProtocolError
from layfigure.protocol import Floats, Ints

SERVER = "layfigure-server"
_TIMEOUT_S = 300.0  # the largest characters that it reads take about a minute


@dataclass(frozen=True, eq=False)
class InspectedBody:
    """A rigid body of the doll, in the bind pose, world axes [m]."""

    name: str
    mass: float  # [kg]
    com: Floats  # (3)
    semi_axes: Floats  # (3, 3), one per row: of the ellipsoid with the body's mass and inertia
    section: Floats  # (N, 3) closed outline of the cut at its joint; N = 0: none was found


@dataclass(frozen=True, eq=False)
class InspectedDoll:
    name: str
    source_file: str
    settings: str  # the file, empty: default
    mass: float  # [kg]
    vertices: Floats  # (V, 3) of the skin
    triangles: Ints  # (T, 3)
    body_of_triangle: Ints  # (T) -1: none
    bodies: tuple[InspectedBody, ...]


def find_server(named: Path | None) -> str:
    """The program named, else the one in PATH."""
    found = shutil.which(str(named) if named is not None else SERVER)
    if found is not None:
        return found
    if named is not None:
        raise LayfigureError(f"'{named}' is no program that can be run: --server-program names {SERVER}")
    raise LayfigureError(f"there is no {SERVER} in PATH: name it with --server-program")


def inspect_character(server: str, character: Path, settings: Path | None) -> tuple[InspectedDoll, str]:
    """Runs the server's --inspect; returns what it told, and what it remarked on stderr."""
    command = [server, "--inspect", str(character), "--json", "--geometry"]
    command += ["--doll", str(settings)] if settings is not None else []
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise LayfigureError(f"'{server}' needed more than {_TIMEOUT_S:g} s for '{character}'") from error
    except OSError as error:
        raise LayfigureError(f"'{server}' cannot be run: {error.strerror}") from error
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"'{server}' ended with exit code {done.returncode}"]
        raise LayfigureError(lines[-1].removeprefix(f"{SERVER}: "))
    return parse_inspection(done.stdout), done.stderr


def parse_inspection(text: str) -> InspectedDoll:
    """Raises ProtocolError if it is not what --inspect --json --geometry prints."""
    try:
        description = json.loads(text)
        return _doll(description, description["geometry"])
    except (ValueError, KeyError, TypeError) as error:
        raise ProtocolError(
            f"{SERVER} told of no doll that can be drawn ({error!r}): is it of this version?"
        ) from error


def _doll(description: dict[str, Any], geometry: dict[str, Any]) -> InspectedDoll:
    doll = InspectedDoll(
        name=str(description["name"]),
        source_file=str(description["source_file"]),
        settings=description["settings"]["source"] or "",
        mass=float(description["mass"]),
        vertices=_points(geometry["vertices"]),
        triangles=np.array(geometry["triangles"], np.int32).reshape(-1, 3),
        body_of_triangle=np.array(geometry["body_of_triangle"], np.int32),
        bodies=tuple(_body(body, shape) for body, shape in zip(description["bodies"], geometry["bodies"], strict=True)),
    )
    _check_indices("vertex", doll.triangles, 0, len(doll.vertices))
    _check_indices("body", doll.body_of_triangle, -1, len(doll.bodies))
    if doll.body_of_triangle.shape != (len(doll.triangles),):
        raise ValueError("not one body for each triangle")
    return doll


def _body(body: dict[str, Any], shape: dict[str, Any]) -> InspectedBody:
    return InspectedBody(
        name=str(body["name"]),
        mass=float(body["mass"]),
        com=_points([shape["com"]])[0],
        semi_axes=_points(shape["semi_axes"]).reshape(3, 3),
        section=_points(shape["section"]),
    )


def _points(rows: Any) -> Floats:
    points = np.array(rows, np.float64).reshape(-1, 3)
    if not np.isfinite(points).all():
        raise ValueError("a point that is not finite")
    return points


def _check_indices(what: str, indices: Ints, least: int, end: int) -> None:
    if indices.size and not (least <= indices.min() and indices.max() < end):
        raise ValueError(f"a {what} that is not there")
