"""Between bytes on the wire and the plain data of protocol.py; the only module that sees the generated types.

Every decoder raises ProtocolError, with a reason in one line, for bytes of another type or version, for numbers that
are not finite and for counts or indices that cannot be: what leaves this module can be computed with.
"""

from __future__ import annotations

import struct
import unicodedata
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from layfigure import messages
from layfigure.errors import ProtocolError
from layfigure.protocol import (
    PROTOCOL_VERSION,
    Argument,
    Character,
    Command,
    Device,
    Floats,
    Floats32,
    Force,
    Image,
    Joint,
    Material,
    Mesh,
    MeshChunk,
    Pointer,
    Pose,
    Reply,
    SpidarCommand,
    SpidarState,
    Status,
)

MAX_JOINTS = 100_000
_SPIDAR_LENGTHS, _SPIDAR_POSE, _SPIDAR_REJECTED = 0, 1, 2  # kinds of a spidar_state_t
_SPIDAR_TENSIONS = 0  # kind of a spidar_command_t
_UNIT_TOLERANCE = 1e-3  # a quaternion or normal further from unit length is no rounding error
_POSE_HEAD = struct.Struct(">8siqqqqq3di")  # of pose_t, up to its arrays
_POSE_JOINT_BYTES = 8 * (4 + 4) + 4 * 3 + 1
_WRAPS = frozenset({"repeat", "clamp", "mirror"})
_Item = TypeVar("_Item")


def decode_character(data: bytes) -> Character:
    raw = _decode(messages.character_t, data)
    joints = tuple(_joint(raw.joints, index) for index in range(raw.joint_count))
    if not 0 < len(joints) <= MAX_JOINTS:
        raise ProtocolError(f"character '{raw.name}' has {len(joints)} joints, expected 1 to {MAX_JOINTS}")
    for name in ("physics_hz", "pose_hz"):
        if not (np.isfinite(getattr(raw, name)) and getattr(raw, name) > 0):
            raise ProtocolError(f"character '{raw.name}': {name} is {getattr(raw, name)}, expected a positive number")
    return Character(
        time_us=raw.time_us,
        server_id=raw.server_id,
        name=raw.name,
        source_file=raw.source_file,
        source_folder=raw.source_folder,
        content_hash=raw.content_hash,
        physics_hz=raw.physics_hz,
        pose_hz=raw.pose_hz,
        clock=raw.clock,
        mesh_bytes=raw.mesh_bytes,
        joints=joints,
    )


def _joint(joints: Sequence[Any], index: int) -> Joint:
    raw = joints[index]
    if not -1 <= raw.parent < index:
        raise ProtocolError(f"joint '{raw.name}' has parent {raw.parent}, expected an earlier joint or -1")
    if np.isnan(raw.yield_torque):
        raise ProtocolError(f"joint '{raw.name}': the yield torque is not a number")
    return Joint(
        name=raw.name,
        parent=raw.parent,
        rest_translation=_finite(raw.rest_translation, "rest_translation"),
        rest_rotation=_rotations(raw.rest_rotation, "rest_rotation"),
        bind_translation=_finite(raw.bind_translation, "bind_translation"),
        bind_rotation=_rotations(raw.bind_rotation, "bind_rotation"),
        is_body=bool(raw.is_body),
        mass=float(_finite(raw.mass, "mass")),
        stiffness=float(_finite(raw.stiffness, "stiffness")),
        yield_torque=raw.yield_torque,
    )


def decode_mesh_chunk(data: bytes) -> MeshChunk:
    raw = _decode(messages.mesh_chunk_t, data)
    if not 0 <= raw.index < raw.total:
        raise ProtocolError(f"mesh chunk {raw.index} of {raw.total}")
    if len(raw.bytes) != raw.byte_count:  # the generated decoder takes what there is
        raise ProtocolError(f"not a whole mesh_chunk_t: {len(raw.bytes)} bytes, expected {raw.byte_count}")
    return MeshChunk(
        server_id=raw.server_id,
        content_hash=raw.content_hash,
        index=raw.index,
        total=raw.total,
        data=bytes(raw.bytes),
    )


def decode_meshes(data: bytes, joint_count: int) -> tuple[Mesh, ...]:
    """Decodes the joined chunks; `joint_count` bounds the joint indices."""
    raw = _decode(messages.meshes_t, data, versioned=False)
    images = [_image(image) for image in raw.images]
    materials = [_material(material, images) for material in raw.materials]
    return tuple(_mesh(mesh, materials, joint_count) for mesh in raw.meshes)


def _image(raw: Any) -> Image:
    if len(raw.bytes) != raw.byte_count:  # the generated decoder takes what there is
        raise ProtocolError(f"not a whole image_t: {len(raw.bytes)} bytes, expected {raw.byte_count}")
    return Image(raw.name, raw.format, bytes(raw.bytes))


def _material(raw: Any, images: list[Image]) -> Material:
    where = f"material '{raw.name}'"
    for name, value in (("opacity", raw.opacity), ("alpha_cutoff", raw.alpha_cutoff)):
        if not 0.0 <= value <= 1.0:
            raise ProtocolError(f"{where}: {name} is {value}, expected 0 to 1")
    wrap = (raw.wrap_u, raw.wrap_v)
    if not set(wrap) <= _WRAPS:
        raise ProtocolError(f"{where} wraps by '{wrap[0]}' and '{wrap[1]}', expected {', '.join(sorted(_WRAPS))}")
    if any(unicodedata.category(letter) == "Cc" for letter in raw.texture):
        raise ProtocolError(f"{where}: its texture's path holds control characters")
    return Material(
        name=raw.name,
        base_color=_finite(raw.base_color, "base_color"),
        opacity=raw.opacity,
        texture_alpha=bool(raw.texture_alpha),
        alpha_cutoff=raw.alpha_cutoff,
        texture=raw.texture,
        image=_chosen(images, raw.image, f"{where}: image"),
        wrap=wrap,
    )


def _chosen(items: list[_Item], index: int, what: str) -> _Item | None:
    if not -1 <= index < len(items):
        raise ProtocolError(f"{what} {index} is out of range, expected -1 to {len(items) - 1}")
    return items[index] if index >= 0 else None


def _mesh(raw: Any, materials: list[Material], joint_count: int) -> Mesh:
    vertices, influences = raw.vertex_count, raw.influence_count
    if min(vertices, influences, raw.triangle_count, raw.normal_count, raw.uv_count) < 0:
        raise ProtocolError(f"mesh '{raw.name}' has a negative count")
    triangles = np.array(raw.triangles, np.int32).reshape(raw.triangle_count, 3)
    mesh = Mesh(
        name=raw.name,
        material=_chosen(materials, raw.material, f"mesh '{raw.name}': material"),
        points=_finite(raw.points, "points").astype(np.float32).reshape(vertices, 3),
        triangles=triangles,
        joint_indices=np.array(raw.joint_indices, np.int32).reshape(vertices, influences),
        joint_weights=_finite(raw.joint_weights, "joint_weights").astype(np.float32).reshape(vertices, influences),
        normals=_directions(raw.normals, f"mesh '{raw.name}': normals") if raw.normal_count else None,
        uvs=_finite(raw.uvs, "uvs").astype(np.float32).reshape(-1, 2) if raw.uv_count else None,
        wedges=np.array(raw.wedge_triangles, np.int32).reshape(-1, 3) if raw.wedge_triangle_count else triangles,
    )
    _check_wedges(mesh)
    for name, indices, end in (("vertex", mesh.triangles, vertices), ("joint", mesh.joint_indices, joint_count)):
        if indices.size and not (indices.min() >= 0 and indices.max() < end):
            raise ProtocolError(f"mesh '{raw.name}': a {name} index is out of range, expected 0 to {end - 1}")
    return mesh


def _check_wedges(mesh: Mesh) -> None:
    if mesh.wedges.shape != mesh.triangles.shape:
        raise ProtocolError(f"mesh '{mesh.name}' has wedges for {len(mesh.wedges)} of {len(mesh.triangles)} triangles")
    for values in (mesh.normals, mesh.uvs):
        if values is None:
            continue
        needed = max(len(mesh.points), int(mesh.wedges.max(initial=-1)) + 1)
        if len(values) < needed or mesh.wedges.min(initial=0) < 0:
            raise ProtocolError(
                f"mesh '{mesh.name}': a wedge is out of range: its normals or uvs are {len(values)}, expected {needed}"
            )


def decode_pose(data: bytes) -> Pose:
    """As pose_t's own decoder, which takes half a millisecond for the numbers of 60 joints, one by one: they are arrays
    here from the beginning."""
    if len(data) < _POSE_HEAD.size or data[:8] != messages.pose_t._get_packed_fingerprint():
        raise _not_whole("pose_t", data)
    _, version, time_us, server_id, content_hash, sequence, step, *root, joints = _POSE_HEAD.unpack_from(data)
    if version != PROTOCOL_VERSION:
        raise _other_version("pose_t", version)
    if joints < 0 or len(data) < _POSE_HEAD.size + _POSE_JOINT_BYTES * joints:
        raise _not_whole("pose_t", data)
    rests = _POSE_HEAD.size + 32 * joints
    torques = rests + 32 * joints
    yielded = torques + 12 * joints
    return Pose(
        time_us=time_us,
        server_id=server_id,
        content_hash=content_hash,
        sequence=sequence,
        step=step,
        root_translation=_finite(root, "root_translation"),
        rotations=_rotations(np.frombuffer(data, ">f8", 4 * joints, _POSE_HEAD.size).reshape(-1, 4), "rotations"),
        rest_rotations=_rotations(np.frombuffer(data, ">f8", 4 * joints, rests).reshape(-1, 4), "rest_rotations"),
        torques=_finite(np.frombuffer(data, ">f4", 3 * joints, torques).reshape(-1, 3), "torques"),
        yielded=np.frombuffer(data, np.uint8, joints, yielded) != 0,
    )


def decode_force(data: bytes) -> Force:
    raw = _decode(messages.force_t, data)
    return Force(
        time_us=raw.time_us,
        server_id=raw.server_id,
        sequence=raw.sequence,
        pointer=raw.pointer,
        tool=raw.tool,
        attached=bool(raw.attached),
        contact=bool(raw.contact),
        joint=raw.joint,
        position=_finite(raw.position, "position"),
        target=_finite(raw.target, "target"),
        force=_finite(raw.force, "force"),
        torque=_finite(raw.torque, "torque"),
        hand_force=_finite(raw.hand_force, "hand_force"),
        hand_torque=_finite(raw.hand_torque, "hand_torque"),
    )


def decode_status(data: bytes) -> Status:
    raw = _decode(messages.status_t, data)
    fields = {name: getattr(raw, name) for name in Status.__dataclass_fields__}
    return Status(**(fields | {"devices": tuple(map(_device, raw.devices))}))


def _device(raw: Any) -> Device:
    fields = {name: getattr(raw, name) for name in Device.__dataclass_fields__}
    return Device(**(fields | {"realtime": bool(raw.realtime)}))


def decode_reply(data: bytes) -> Reply:
    raw = _decode(messages.reply_t, data)
    return Reply(
        time_us=raw.time_us,
        server_id=raw.server_id,
        client_id=raw.client_id,
        sequence=raw.sequence,
        accepted=bool(raw.accepted),
        reason=raw.reason,
        results=tuple(Argument(result.name, result.text, tuple(result.values)) for result in raw.results),
    )


def encode_command(command: Command) -> bytes:
    raw = messages.command_t()
    raw.protocol_version = PROTOCOL_VERSION
    raw.time_us = command.time_us
    raw.server_id = command.server_id
    raw.client_id = command.client_id
    raw.sequence = command.sequence
    raw.name = command.name
    raw.argument_count = len(command.arguments)
    raw.arguments = [_raw_argument(argument) for argument in command.arguments]
    return bytes(raw.encode())


def _raw_argument(argument: Argument) -> Any:
    raw = messages.argument_t()
    raw.name = argument.name
    raw.text = argument.text
    raw.value_count = len(argument.values)
    raw.values = list(argument.values)
    return raw


def encode_pointer(pointer: Pointer) -> bytes:
    raw = messages.pointer_t()
    raw.protocol_version = PROTOCOL_VERSION
    raw.time_us = pointer.time_us
    raw.server_id = pointer.server_id
    raw.client_id = pointer.client_id
    raw.sequence = pointer.sequence
    raw.pointer = pointer.pointer
    raw.position = pointer.position.tolist()
    raw.rotation = pointer.rotation.tolist()
    return bytes(raw.encode())


def encode_spidar_state(state: SpidarState) -> bytes:
    raw = messages.spidar_state_t()
    raw.protocol_version = PROTOCOL_VERSION
    raw.time_us = state.time_us
    raw.device_id = state.device_id
    raw.sequence = state.sequence
    raw.kind = _SPIDAR_REJECTED
    raw.rotation = [1.0, 0.0, 0.0, 0.0]
    if state.lengths is not None:
        raw.kind = _SPIDAR_LENGTHS
        raw.lengths = state.lengths.tolist()
    elif state.position is not None and state.rotation is not None:
        raw.kind = _SPIDAR_POSE
        raw.position = state.position.tolist()
        raw.rotation = state.rotation.tolist()
    raw.grip = state.grip
    raw.buttons = state.buttons
    return bytes(raw.encode())


def decode_spidar_command(data: bytes) -> SpidarCommand:
    raw = _decode(messages.spidar_command_t, data)
    return SpidarCommand(
        time_us=raw.time_us,
        device_id=raw.device_id,
        sequence=raw.sequence,
        state_sequence=raw.state_sequence,
        active=bool(raw.active),
        tensions=_finite(raw.tensions, "tensions") if raw.kind == _SPIDAR_TENSIONS else None,
        force=_finite(raw.force, "force"),
        torque=_finite(raw.torque, "torque"),
    )


def _decode(message_type: Any, data: bytes, versioned: bool = True) -> Any:
    name = message_type.__name__
    try:
        raw = message_type.decode(data)
    except (ValueError, struct.error, AssertionError, IndexError, MemoryError) as error:
        raise _not_whole(name, data) from error
    if versioned and raw.protocol_version != PROTOCOL_VERSION:
        raise _other_version(name, raw.protocol_version)
    return raw


def _not_whole(name: str, data: bytes) -> ProtocolError:
    return ProtocolError(f"not a whole {name} of this version ({len(data)} bytes)")


def _other_version(name: str, version: int) -> ProtocolError:
    return ProtocolError(f"{name} of protocol version {version}, expected {PROTOCOL_VERSION}")


def _finite(values: Any, name: str) -> Floats:
    array = np.asarray(values, np.float64)
    if not np.isfinite(array).all():
        raise ProtocolError(f"{name} holds a value that is not finite")
    return array


def _directions(values: Any, name: str) -> Floats32:
    """(N, 3) unit vectors."""
    array = _finite(values, name).reshape(-1, 3)
    if not (np.abs(np.linalg.norm(array, axis=1) - 1.0) < _UNIT_TOLERANCE).all():
        raise ProtocolError(f"{name} hold a vector that is not of unit length")
    return array.astype(np.float32)


def _rotations(values: Any, name: str) -> Floats:
    array = _finite(values, name).reshape(-1, 4)
    with np.errstate(over="ignore"):  # what overflows is not of unit length
        lengths = np.linalg.norm(array, axis=1, keepdims=True)
    if not (np.abs(lengths - 1.0) < _UNIT_TOLERANCE).all():
        raise ProtocolError(f"{name} holds a quaternion that is not of unit length")
    unit: Floats = array / lengths
    return unit.reshape(np.shape(values)) if unit.size else unit
