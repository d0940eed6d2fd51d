"""A synthetic character: an arm of three bones and a thumb that rides along, in a skinned tube, that bends."""

from __future__ import annotations

import math

import numpy as np

from layfigure import messages
from layfigure.protocol import PROTOCOL_VERSION, Floats

SERVER_ID = 0x1122334455667788
CONTENT_HASH = 0x0123456789ABCDEF
PHYSICS_HZ = 1000.0
POSE_HZ = 60.0
NAMES = ["mixamorig:Hips", "mixamorig:LeftArm", "mixamorig:LeftHand", "thumb.L"]
PARENTS = [-1, 0, 1, 1]
OFFSETS = [(0.0, 0.0, 1.0), (0.0, 0.3, 0.0), (0.0, 0.25, 0.0), (0.05, 0.2, 0.0)]
YIELD_TORQUES = [math.inf, 5.0, 1.5, 0.0]
RINGS, SIDES, RADIUS = 13, 8, 0.04


def quaternion(axis: tuple[float, float, float], angle: float) -> Floats:
    """w x y z."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) * unit])


def rest_rotations() -> Floats:
    """Bones that do not lie along the axes: a transposed matrix or a wrong frame shows."""
    return np.array(
        [
            quaternion((1, 2, 3), 0.3),
            quaternion((0, 1, 1), 0.7),
            quaternion((1, 0, 0), -0.4),
            quaternion((0, 0, 1), 1.1),
        ]
    )


def pose_rotations(time_s: float) -> Floats:
    """Each joint swings about an axis of its own, the hand through more than half a turn."""
    rests = rest_rotations()
    swings = [
        quaternion((0, 0, 1), 0.2 * time_s),
        quaternion((1, 0, 0), math.sin(time_s)),
        quaternion((0, 1, 0.2), 4.0 * time_s),
        np.array([1.0, 0, 0, 0]),
    ]
    return np.array([multiply(rest, swing) for rest, swing in zip(rests, swings, strict=True)])


def multiply(a: Floats, b: Floats) -> Floats:
    """The product of two quaternions, by the textbook's formula with dot and cross products."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[w], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def matrix(q: Floats, translation: Floats) -> Floats:
    """4x4, acting on columns; the textbook's formula, so that the tests share nothing with what they test."""
    w, x, y, z = q
    result = np.eye(4)
    result[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    result[:3, 3] = translation
    return result


def world_matrices(rotations: Floats, root_translation: Floats | None = None) -> list[Floats]:
    worlds: list[Floats] = []
    for j, parent in enumerate(PARENTS):
        offset = np.array(OFFSETS[j]) if root_translation is None or parent >= 0 else root_translation
        local = matrix(rotations[j], offset)
        worlds.append(local if parent < 0 else worlds[parent] @ local)
    return worlds


def root_translation(time_s: float) -> Floats:
    return np.array([0.1 * time_s, 0.0, 1.0])


def character_message(server_id: int = SERVER_ID, clock: str = "realtime", content_hash: int = CONTENT_HASH):
    message = messages.character_t()
    message.protocol_version = PROTOCOL_VERSION
    message.server_id = server_id
    message.name = "Synthetic arm"
    message.source_file = "arm.glb"
    message.source_folder = "/nowhere/characters"
    message.content_hash = content_hash
    message.physics_hz = PHYSICS_HZ
    message.pose_hz = POSE_HZ
    message.clock = clock
    message.mesh_bytes = len(meshes_message(content_hash).encode())
    message.joints = [_joint(j) for j in range(len(NAMES))]
    message.joint_count = len(NAMES)
    return message


def _joint(j: int):
    joint = messages.joint_t()
    bind = world_matrices(rest_rotations())[j]
    joint.name = NAMES[j]
    joint.parent = PARENTS[j]
    joint.rest_translation = list(OFFSETS[j])
    joint.rest_rotation = rest_rotations()[j].tolist()
    joint.bind_translation = bind[:3, 3].tolist()
    joint.bind_rotation = world_rotation(j).tolist()
    joint.is_body = j < 3
    joint.mass = [3.0, 1.5, 0.5, 0.0][j]
    joint.stiffness = [50.0, 30.0, 10.0, 0.0][j]
    joint.yield_torque = YIELD_TORQUES[j]
    return joint


def world_rotation(j: int) -> Floats:
    rotation = rest_rotations()[j]
    return rotation if PARENTS[j] < 0 else multiply(world_rotation(PARENTS[j]), rotation)


def meshes_message(content_hash: int = CONTENT_HASH):
    message = messages.meshes_t()
    message.content_hash = content_hash
    message.meshes = [_tube()]
    message.mesh_count = 1
    message.materials = [material_message()]
    message.material_count = 1
    return message


def material_message(name: str = "skin", color: tuple[float, float, float] = (0.8, 0.5, 0.3)):
    material = messages.material_t()
    material.name = name
    material.base_color = list(color)
    material.opacity = 1.0
    material.image = -1
    material.wrap_u = material.wrap_v = "repeat"
    return material


def image_message(data: bytes, name: str = "", format_name: str = "png"):
    image = messages.image_t()
    image.name, image.format = name, format_name
    image.bytes, image.byte_count = data, len(data)
    return image


def wrap_texture(mesh, normals: bool = True) -> None:
    """Gives the tube texture coordinates: u once around it, with a seam at its side 0, v from the first ring to the
    last; and normals that point away from its axis, turned by a quarter of a radian at the seam's other side."""
    points = np.array(mesh.points).reshape(RINGS, SIDES, 3)
    outward = points - points.mean(axis=1, keepdims=True)
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    rows = np.arange(RINGS) / (RINGS - 1)
    uvs = [[side / SIDES, rows[ring]] for ring in range(RINGS) for side in range(SIDES)]
    mesh.uvs = uvs + [[1.0, row] for row in rows]
    mesh.uv_count = len(mesh.uvs)
    mesh.wedge_triangles = [list(triangle) for triangle in mesh.triangles]
    for number, triangle in enumerate(mesh.wedge_triangles):
        if number // 2 % SIDES == SIDES - 1:  # the last side: its corners at side 0 are on the seam's other side
            for corner, vertex in enumerate(triangle):
                if vertex % SIDES == 0:
                    triangle[corner] = RINGS * SIDES + vertex // SIDES
    mesh.wedge_triangle_count = len(mesh.wedge_triangles)
    if normals:
        along = (points[-1, 0] - points[0, 0]) / np.linalg.norm(points[-1, 0] - points[0, 0])
        other = outward[:, 0] * math.cos(0.25) + np.cross(along, outward[:, 0]) * math.sin(0.25)
        other /= np.linalg.norm(other, axis=1, keepdims=True)
        mesh.normals = [*outward.reshape(-1, 3).tolist(), *other.tolist()]
        mesh.normal_count = len(mesh.normals)


def _tube():
    """Rings along the arm in its bind pose; each vertex shares two bones."""
    binds = [m[:3, 3] for m in world_matrices(rest_rotations())]
    mesh = messages.mesh_t()
    mesh.name = "arm mesh"
    mesh.material = 0
    mesh.influence_count = 2
    for ring in range(RINGS):
        s = 2.0 * ring / (RINGS - 1)
        bone = min(int(s), 1)
        centre = (1 - (s - bone)) * binds[bone] + (s - bone) * binds[bone + 1]
        for side in range(SIDES):
            angle = 2 * math.pi * side / SIDES
            mesh.points.append(
                (centre + RADIUS * np.array([math.cos(angle), 0.3 * math.cos(angle), math.sin(angle)])).tolist()
            )
            mesh.joint_indices.append([bone, bone + 1])
            mesh.joint_weights.append([1 - (s - bone), s - bone])
    for ring in range(RINGS - 1):
        for side in range(SIDES):
            a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
            mesh.triangles += [[a, b + SIDES, b], [a, a + SIDES, b + SIDES]]
    mesh.vertex_count, mesh.triangle_count = len(mesh.points), len(mesh.triangles)
    return mesh


def chunk_messages(size: int = 1000, server_id: int = SERVER_ID, content_hash: int = CONTENT_HASH) -> list:
    data = meshes_message(content_hash).encode()
    parts = [data[start : start + size] for start in range(0, len(data), size)]
    chunks = []
    for index, part in enumerate(parts):
        chunk = messages.mesh_chunk_t()
        chunk.protocol_version = PROTOCOL_VERSION
        chunk.server_id = server_id
        chunk.content_hash = content_hash
        chunk.index, chunk.total = index, len(parts)
        chunk.bytes, chunk.byte_count = part, len(part)
        chunks.append(chunk)
    return chunks


def pose_message(sequence: int, server_id: int = SERVER_ID, content_hash: int = CONTENT_HASH):
    """Pose `sequence` at its time; LeftArm flows in the poses 10 to 19."""
    step = math.ceil(sequence * PHYSICS_HZ / POSE_HZ)
    time_s = step / PHYSICS_HZ
    message = messages.pose_t()
    message.protocol_version = PROTOCOL_VERSION
    message.time_us = round(time_s * 1e6)
    message.server_id = server_id
    message.content_hash = content_hash
    message.sequence = sequence
    message.step = step
    message.root_translation = root_translation(time_s).tolist()
    message.joint_count = len(NAMES)
    message.rotations = pose_rotations(time_s).tolist()
    message.rest_rotations = rest_rotations().tolist()
    message.torques = [[0.1 * j, 5.0 * math.sin(time_s), 0.0] for j in range(len(NAMES))]
    message.yielded = [j == 1 and 10 <= sequence < 20 for j in range(len(NAMES))]
    return message


def force_message(sequence: int, server_id: int = SERVER_ID):
    message = messages.force_t()
    message.protocol_version = PROTOCOL_VERSION
    message.time_us = pose_message(sequence).time_us
    message.server_id = server_id
    message.sequence = sequence
    message.attached = sequence >= 5
    message.joint = 2 if message.attached else -1
    message.force = [10.0 * math.sin(0.1 * sequence), 0.0, 5.0] if message.attached else [0.0] * 3
    return message


def status_message(state: str = "running", server_id: int = SERVER_ID, clock: str = "realtime"):
    message = messages.status_t()
    message.protocol_version = PROTOCOL_VERSION
    message.server_id = server_id
    message.state = state
    message.clock = clock
    message.realtime_factor = 12.5
    return message


def device_message(pointer: int, name: str):
    message = messages.device_t()
    message.name = name
    message.pointer = pointer
    message.state = "ok"
    message.share = 1.0
    return message
