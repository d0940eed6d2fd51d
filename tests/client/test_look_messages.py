"""Textures, texture coordinates and normals in the messages of a character."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from client_support import synthetic
from client_support.looks import textured_meshes

from layfigure import codec
from layfigure.errors import ProtocolError


def test_decode_meshes_share_their_material_and_its_picture() -> None:
    first, second = codec.decode_meshes(textured_meshes(image=b"bytes").encode(), 4)
    assert first.material is second.material
    assert first.material is not None
    assert first.material.image is not None
    assert first.material.image.data == b"bytes"
    assert first.normals is not None
    assert first.normals.shape == (13 * 8 + 13, 3)


def test_decode_meshes_without_looks_has_none() -> None:
    message = synthetic.meshes_message()
    message.meshes[0].material = -1
    (mesh,) = codec.decode_meshes(message.encode(), 4)
    assert (mesh.material, mesh.normals, mesh.uvs) == (None, None, None)
    np.testing.assert_array_equal(mesh.wedges, mesh.triangles)


def set_count(name: str, values: str, rows: list[list[float]]) -> Callable[[Any], None]:
    def damage(message: Any) -> None:
        setattr(message.meshes[0], values, rows)
        setattr(message.meshes[0], name, len(rows))

    return damage


def set_material(name: str, value: object) -> Callable[[Any], None]:
    return lambda message: setattr(message.materials[0], name, value)


def set_normal(value: list[float]) -> Callable[[Any], None]:
    return lambda message: message.meshes[0].normals.__setitem__(3, value)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (set_count("uv_count", "uvs", [[0.0, 0.0]] * 116), "a wedge is out of range: its normals or uvs are 116"),
        (set_count("normal_count", "normals", [[0.0, 0.0, 1.0]] * 104), "expected 117"),
        (set_count("wedge_triangle_count", "wedge_triangles", [[0, 1, 2]] * 5), "wedges for 5 of 192"),
        (set_count("wedge_triangle_count", "wedge_triangles", [[0, 1, -2]] * 192), "a wedge is out of range"),
        (set_normal([0.0, 0.0, 0.5]), "not of unit length"),
        (set_normal([float("nan"), 0.0, 1.0]), "not finite"),
        (lambda message: message.meshes[0].uvs.__setitem__(0, [float("inf"), 0.0]), "not finite"),
        (lambda message: setattr(message.meshes[1], "material", 1), "material 1 is out of range"),
        (set_material("image", 1), "image 1 is out of range"),
        (set_material("image", -2), "image -2 is out of range"),
        (set_material("opacity", 1.5), "opacity is 1.5"),
        (set_material("alpha_cutoff", float("nan")), "alpha_cutoff is nan"),
        (set_material("wrap_v", "twice"), "'repeat' and 'twice'"),
        (set_material("base_color", [0.0, float("nan"), 0.0]), "not finite"),
        (set_material("texture", "a\nb.png"), "control characters"),
    ],
)
def test_decode_meshes_with_impossible_looks_is_refused(damage: Callable[[Any], None], reason: str) -> None:
    message = textured_meshes(image=b"x")
    damage(message)
    with pytest.raises(ProtocolError, match=reason):
        codec.decode_meshes(message.encode(), 4)


def test_decode_meshes_of_an_older_layout_is_refused() -> None:
    data = bytearray(textured_meshes().encode())
    data[:8] = b"\x12\x34\x56\x78\x9a\xbc\xde\xf0"  # LCM's fingerprint of the type's fields
    with pytest.raises(ProtocolError, match="not a whole meshes_t of this version"):
        codec.decode_meshes(bytes(data), 4)
