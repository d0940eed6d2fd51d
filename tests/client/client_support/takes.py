"""Takes of the synthetic character."""

from __future__ import annotations

from client_support import synthetic
from layfigure import codec
from layfigure.mesh_assembly import MeshAssembly
from layfigure.take import Take, TakeBuilder


def make_builder(**character_arguments: object) -> TakeBuilder:
    character = codec.decode_character(synthetic.character_message(**character_arguments).encode())
    assembly = MeshAssembly(character)
    for chunk in synthetic.chunk_messages():
        assembly.add(codec.decode_mesh_chunk(chunk.encode()))
    return TakeBuilder(character, assembly.meshes())


def make_take_of(meshes: object, source_folder: str = "", poses: int = 13) -> Take:
    """Of other meshes (meshes_t) of the synthetic character, in `source_folder`."""
    message = synthetic.character_message()
    message.source_folder = source_folder
    character = codec.decode_character(message.encode())
    decoded = codec.decode_meshes(meshes.encode(), len(character.joints))  # type: ignore[attr-defined]
    return _fill(TakeBuilder(character, decoded), poses)


def make_take(poses: int = 61) -> Take:
    """One second at 60 poses a second, both ends included."""
    return _fill(make_builder(), poses)


def _fill(builder: TakeBuilder, poses: int) -> Take:
    for sequence in range(poses):
        builder.add_pose(codec.decode_pose(synthetic.pose_message(sequence).encode()))
        builder.add_force(codec.decode_force(synthetic.force_message(sequence).encode()))
    return builder.build()
