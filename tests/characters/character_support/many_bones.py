"""Files of as many bones as one likes and a triangle, in every format whose text can name them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from .glb_document import triangle, write_glb

IDENTITY = "1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0"


def write(path: Path, parts: Iterator[str]) -> Path:
    with path.open("w") as file:
        file.writelines(parts)
    return path


def bvh(count: int) -> Iterator[str]:
    channels = "CHANNELS 3 Xrotation Yrotation Zrotation\n"
    yield "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\n" + channels
    for k in range(count):
        yield f"JOINT n{k}\n{{\nOFFSET 0 1 0\n{channels}End Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
    yield "}\nMOTION\nFrames: 1\nFrame Time: 1\n" + "0 " * (3 * count + 3) + "\n"


def deep_bvh(count: int) -> Iterator[str]:
    yield "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
    for k in range(count):
        yield f"JOINT n{k}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
    yield "End Site\n{\nOFFSET 0 1 0\n}\n" + "}\n" * (count + 1)
    yield "MOTION\nFrames: 1\nFrame Time: 1\n" + "0 " * (3 * count + 3) + "\n"


def direct_x(count: int) -> Iterator[str]:
    yield f"xof 0303txt 0032\nFrame r {{ FrameTransformMatrix {{ {IDENTITY};; }}\n"
    yield "Mesh m { 3; 0.0;0.0;0.0;,1.0;0.0;0.0;,0.0;1.0;0.0;; 1; 3;0,1,2;;\n"
    yield f"XSkinMeshHeader {{ 1; 1; {count}; }}\n"
    for k in range(count):
        yield f'SkinWeights {{ "n{k}"; 1; 0; 1.0; {IDENTITY};; }}\n'
    yield "}\n"
    for k in range(count):
        yield f"Frame n{k} {{ FrameTransformMatrix {{ {IDENTITY};; }} }}\n"
    yield "}\n"


def collada(count: int) -> Iterator[str]:
    def source(name: str, kind: str, values: str, size: int, stride: int, param: str) -> str:
        return (
            f'<source id="{name}"><{kind} id="{name}a" count="{size}">{values}</{kind}><technique_common>'
            f'<accessor source="#{name}a" count="{size // stride}" stride="{stride}">{param}</accessor>'
            "</technique_common></source>"
        )

    places = "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
    yield '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>'
    yield '<library_geometries><geometry id="g"><mesh>' + source("p", "float_array", "0 0 0 1 0 0 0 1 0", 9, 3, places)
    yield '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1">'
    yield '<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>'
    yield '</library_geometries><library_controllers><controller id="c"><skin source="#g">'
    names = " ".join(f"n{k}" for k in range(count))
    yield source("j", "Name_array", names, count, 1, '<param name="JOINT" type="Name"/>')
    binds = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 " * count
    yield source("b", "float_array", binds, 16 * count, 16, '<param name="TRANSFORM" type="float4x4"/>')
    yield source("w", "float_array", "1", 1, 1, '<param name="WEIGHT" type="float"/>')
    yield '<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/></joints>'
    yield '<vertex_weights count="3"><input semantic="JOINT" source="#j" offset="0"/>'
    yield '<input semantic="WEIGHT" source="#w" offset="1"/><vcount>1 1 1</vcount><v>0 0 0 0 0 0</v></vertex_weights>'
    yield '</skin></controller></library_controllers><library_visual_scenes><visual_scene id="s"><node id="r">'
    for k in range(count):
        yield f'<node id="n{k}" sid="n{k}" name="n{k}" type="JOINT"/>'
    yield '</node><node id="m"><instance_controller url="#c"><skeleton>#r</skeleton></instance_controller></node>'
    yield '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'


def smd(count: int) -> Iterator[str]:
    yield "version 1\nnodes\n"
    for k in range(count):
        yield f'{k} "n{k}" {0 if k else -1}\n'
    yield "end\nskeleton\ntime 0\n"
    for k in range(count):
        yield f"{k} 0 1 0 0 0 0\n"
    yield "end\ntriangles\nm.bmp\n0 0 0 0 0 0 1 0 0\n0 1 0 0 0 0 1 1 0\n0 0 1 0 0 0 1 0 1\nend\n"


def text_file(lines: Callable[[int], Iterator[str]], ending: str) -> Callable[[Path, int], Path]:
    def make(folder: Path, count: int) -> Path:
        return write(folder / f"bones.{ending}", lines(count))

    return make


def glb(folder: Path, count: int) -> Path:
    nodes = [{"mesh": 0, "skin": 0, "children": list(range(1, count))}]
    nodes += [{"name": f"n{k}"} for k in range(1, count)]
    return write_glb(folder / "bones.glb", *triangle(nodes, list(range(1, count))))


FORMATS = {
    "bvh": text_file(bvh, "bvh"),
    "deep bvh": text_file(deep_bvh, "bvh"),
    "x": text_file(direct_x, "x"),
    "collada": text_file(collada, "dae"),
    "smd": text_file(smd, "smd"),
    "glb": glb,
}
