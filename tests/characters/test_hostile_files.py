"""Files that are made to harm: each is refused with one line, in bounded time and memory, and reads nothing else.

Mutants of real files are imported by tests/fuzz; here is what chance does not find.
"""

from __future__ import annotations

import base64
import json
import os
import resource
import struct
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from character_support.answer import inspect
from character_support.glb_document import Json, triangle, write_glb


def million_nodes(folder: Path) -> Path:
    count = 1_100_000
    nodes: list[Json] = [{"mesh": 0, "skin": 0, "children": list(range(1, count))}]
    nodes += [{"name": f"n{k}"} for k in range(1, count)]
    return write_glb(folder / "million_nodes.glb", *triangle(nodes, [1]))


def deep_chain(folder: Path) -> Path:
    count = 200_000
    nodes: list[Json] = [{"mesh": 0, "skin": 0, "children": [1]}]
    nodes += [{"name": f"n{k}", "children": [k + 1]} for k in range(1, count - 1)] + [{"name": "last"}]
    return write_glb(folder / "deep_chain.glb", *triangle(nodes, [1]))


def many_joints(folder: Path) -> Path:
    count = 100_000  # assimp's time grows with the square of it
    nodes: list[Json] = [{"mesh": 0, "skin": 0, "children": list(range(1, count))}]
    nodes += [{"name": f"n{k}"} for k in range(1, count)]
    return write_glb(folder / "many_joints.glb", *triangle(nodes, list(range(1, count))))


def node_cycle(folder: Path) -> Path:
    nodes: list[Json] = [{"mesh": 0, "skin": 0, "children": [1]}, {"children": [2]}, {"children": [1]}]
    return write_glb(folder / "cycle.glb", *triangle(nodes, [1, 2]))


def deep_json(folder: Path) -> Path:
    depth = 1_000_000
    path = folder / "deep.gltf"
    path.write_text('{"asset": {"version": "2.0", "extras": ' + "[" * depth + "]" * depth + "}}")
    return path


def huge_counts(folder: Path) -> Path:
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    for accessor in document["accessors"]:
        accessor["count"] = 2**62
    return write_glb(folder / "counts.glb", document, data)


def sparse_bomb(folder: Path) -> Path:
    """An accessor of 4 billion zeros that no byte of the file holds."""
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    document["accessors"][0] = {
        "componentType": 5126,
        "count": 2**32 - 1,
        "type": "VEC3",
        "sparse": {
            "count": 1,
            "indices": {"bufferView": 2, "componentType": 5121},
            "values": {"bufferView": 0},
        },
    }
    return write_glb(folder / "sparse.glb", document, data)


def buffer_of_another_file(folder: Path) -> Path:
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    document["buffers"] = [{"byteLength": len(data), "uri": "../../../../../../../etc/passwd"}]
    path = folder / "traversal.gltf"
    path.write_text(json.dumps(document))
    return path


def endless_buffer(folder: Path) -> Path:
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    document["buffers"] = [{"byteLength": len(data), "uri": "/dev/zero"}]
    path = folder / "endless.gltf"
    path.write_text(json.dumps(document))
    return path


def buffer_shorter_than_it_says(folder: Path) -> Path:
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    uri = "data:application/octet-stream;base64," + base64.b64encode(data[:40]).decode()
    document["buffers"] = [{"byteLength": 2**40, "uri": uri}]
    path = folder / "short.gltf"
    path.write_text(json.dumps(document))
    return path


COLLADA = """<?xml version="1.0"?>{doctype}
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>
<library_nodes>{nodes}</library_nodes>
<library_visual_scenes><visual_scene id="s"><node id="top"><instance_node url="#n0"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


def node_bomb(folder: Path) -> Path:
    """Each node holds the next one twice: 2^40 nodes."""
    nodes = [
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>' for k in range(40)
    ]
    path = folder / "bomb.dae"
    path.write_text(COLLADA.format(doctype="", asset="", nodes="".join(nodes) + '<node id="n40"/>'))
    return path


def node_of_itself(folder: Path) -> Path:
    path = folder / "itself.dae"
    path.write_text(COLLADA.format(doctype="", asset="", nodes='<node id="n0"><instance_node url="#n0"/></node>'))
    return path


def entity_bomb(folder: Path) -> Path:
    entities = ['<!ENTITY e0 "ha">'] + [f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 20)]
    path = folder / "laughs.dae"
    path.write_text(COLLADA.format(doctype=f"<!DOCTYPE l [{''.join(entities)}]>", asset="&e19;", nodes=""))
    return path


def entity_of_another_file(folder: Path) -> Path:
    doctype = '<!DOCTYPE l [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
    path = folder / "entity.dae"
    path.write_text(COLLADA.format(doctype=doctype, asset="<title>&x;</title>", nodes=""))
    return path


def zip_bomb(folder: Path) -> Path:
    """An archive of some bytes whose member says that it is 4 GB."""
    path = folder / "bomb.zae"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.xml", "<dae_root>bomb.dae</dae_root>")
        archive.writestr("bomb.dae", b" " * 1000)
    size = struct.pack("<I", 1000)
    path.write_bytes(path.read_bytes().replace(size, b"\xf0\xff\xff\xff"))
    return path


def bone_cycle(folder: Path) -> Path:
    path = folder / "cycle.smd"
    path.write_text(
        'version 1\nnodes\n0 "a" 1\n1 "b" 0\nend\nskeleton\ntime 0\n0 0 0 0 0 0 0\n1 0 0 0 0 0 0\nend\n'
        "triangles\nx.bmp\n0 0 0 0 0 0 1 0 0\n1 1 0 0 0 0 1 0 0\n0 0 1 0 0 0 1 0 0\nend\n"
    )
    return path


def md5_of_huge_counts(folder: Path) -> Path:
    path = folder / "counts.md5mesh"
    path.write_text(
        'MD5Version 10\ncommandline ""\nnumJoints 2147483647\nnumMeshes 2147483647\njoints {\n'
        '"a" -1 ( 0 0 0 ) ( 0 0 0 )\n}\nmesh {\nshader ""\nnumverts 2147483647\nnumtris 2147483647\n'
        "numweights 2147483647\n}\n"
    )
    return path


def deep_fbx(folder: Path) -> Path:
    path = folder / "deep.fbx"
    path.write_text("; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n" + "a: {\n" * 300_000)
    return path


FILES: list[Callable[[Path], Path]] = [
    million_nodes,
    deep_chain,
    many_joints,
    node_cycle,
    deep_json,
    huge_counts,
    sparse_bomb,
    buffer_of_another_file,
    endless_buffer,
    buffer_shorter_than_it_says,
    node_bomb,
    node_of_itself,
    entity_bomb,
    entity_of_another_file,
    zip_bomb,
    bone_cycle,
    md5_of_huge_counts,
    deep_fbx,
]


@pytest.mark.parametrize("make", FILES, ids=lambda make: make.__name__)
def test_file_made_to_harm_is_refused_with_one_line(binary: Path, tmp_path: Path, make: Callable[[Path], Path]) -> None:
    answer = inspect(binary, make(tmp_path))
    assert answer.code == 1
    assert "root:" not in answer.stderr  # of /etc/passwd


def test_texture_outside_the_folder_is_not_looked_at(binary: Path, tmp_path: Path) -> None:
    """A character that is sound but for its texture's path is read, and the path left alone."""
    document, data = triangle([{"mesh": 0, "skin": 0, "children": [1]}, {"name": "bone"}], [1])
    (tmp_path / "pipe").mkdir()
    os.mkfifo(tmp_path / "pipe/endless.png")
    document["images"] = [{"uri": uri} for uri in ("../../../etc/passwd", "file:///etc/passwd", "pipe/endless.png")]
    document["textures"] = [{"source": k} for k in range(3)]
    document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in range(3)]
    document["meshes"][0]["primitives"][0]["material"] = 0
    answer = inspect(binary, write_glb(tmp_path / "textured.glb", document, data))
    assert "no bone has enough skin" in answer.stderr  # it was read: one triangle is no body


def test_limits_leave_core_files_alone(binary: Path, tmp_path: Path) -> None:
    """A reader that crashes leaves no core file behind."""
    soft, hard = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (hard, hard))
    try:
        subprocess.run([binary, "--inspect", deep_json(tmp_path)], cwd=tmp_path, capture_output=True, check=False)
    finally:
        resource.setrlimit(resource.RLIMIT_CORE, (soft, hard))
    assert [file.name for file in tmp_path.iterdir()] == ["deep.gltf"]
