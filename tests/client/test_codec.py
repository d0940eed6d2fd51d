import math
from collections.abc import Callable

import numpy as np
import pytest
from client_support import synthetic

from layfigure import codec, messages
from layfigure.errors import ProtocolError
from layfigure.protocol import Argument, Command, Pointer

DECODERS = {
    "character_t": (codec.decode_character, lambda: synthetic.character_message()),
    "mesh_chunk_t": (codec.decode_mesh_chunk, lambda: synthetic.chunk_messages()[0]),
    "pose_t": (codec.decode_pose, lambda: synthetic.pose_message(3)),
    "force_t": (codec.decode_force, lambda: synthetic.force_message(6)),
    "status_t": (codec.decode_status, lambda: synthetic.status_message()),
}


@pytest.mark.parametrize("name", DECODERS)
def test_decode_every_truncation_is_refused(name: str) -> None:
    decode, make = DECODERS[name]
    data = make().encode()
    for length in range(len(data) - 1):
        with pytest.raises(ProtocolError, match=name):
            decode(data[:length])


@pytest.mark.parametrize("name", DECODERS)
def test_decode_other_version_is_refused(name: str) -> None:
    decode, make = DECODERS[name]
    message = make()
    message.protocol_version = 99
    with pytest.raises(ProtocolError, match=r"version 99, expected 1"):
        decode(message.encode())


@pytest.mark.parametrize("name", DECODERS)
def test_decode_other_type_is_refused(name: str) -> None:
    decode, _ = DECODERS[name]
    with pytest.raises(ProtocolError):
        decode(messages.argument_t().encode())


@pytest.mark.parametrize("joints", [0, 1, 60])
def test_decode_pose_reads_what_the_generated_type_reads(joints: int) -> None:
    random = np.random.default_rng(joints)
    turns = random.normal(size=(2, joints, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    message = synthetic.pose_message(7)
    message.joint_count = joints
    message.root_translation = random.normal(size=3).tolist()
    message.rotations, message.rest_rotations = turns.tolist()
    message.torques = random.normal(size=(joints, 3)).tolist()
    message.yielded = (random.random(joints) < 0.5).tolist()
    data = message.encode()
    pose, generated = codec.decode_pose(data), messages.pose_t.decode(data)
    for name in ("time_us", "server_id", "content_hash", "sequence", "step"):
        assert getattr(pose, name) == getattr(generated, name)
    for name, width in (("root_translation", 1), ("torques", 3), ("yielded", 1)):
        wanted = np.array(getattr(generated, name)).reshape(getattr(pose, name).shape)
        np.testing.assert_array_equal(getattr(pose, name), wanted)
        assert getattr(pose, name).size == width * (3 if name == "root_translation" else joints)
    for name in ("rotations", "rest_rotations"):  # of unit length to the last digit
        wanted = np.array(getattr(generated, name)).reshape(-1, 4)
        np.testing.assert_allclose(getattr(pose, name), wanted, rtol=0.0, atol=1e-15)
        assert getattr(pose, name).shape == (joints, 4)


@pytest.mark.parametrize("joints", [-1, 5, 2**31 - 1])
def test_decode_pose_of_more_joints_than_it_has_is_refused(joints: int) -> None:
    data = bytearray(synthetic.pose_message(3).encode())
    count = 8 + 4 + 5 * 8 + 3 * 8  # after the fingerprint, the version, five numbers and the root's translation
    data[count : count + 4] = joints.to_bytes(4, "big", signed=True)
    with pytest.raises(ProtocolError, match="not a whole pose_t"):
        codec.decode_pose(bytes(data))


def set_field(message: object, path: str, value: object) -> None:
    *parents, last = path.split(".")
    for name in parents:
        message = message[int(name)] if name.isdigit() else getattr(message, name)  # type: ignore[index]
    if last.isdigit():
        message[int(last)] = value  # type: ignore[index]
    else:
        setattr(message, last, value)


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize(
    ("name", "field"),
    [
        ("character_t", "joints.1.rest_translation.0"),
        ("character_t", "joints.1.bind_rotation.2"),
        ("character_t", "joints.2.mass"),
        ("character_t", "pose_hz"),
        ("pose_t", "root_translation.1"),
        ("pose_t", "rotations.2.3"),
        ("pose_t", "rest_rotations.0.0"),
        ("pose_t", "torques.3.1"),
        ("force_t", "force.0"),
    ],
)
def test_decode_not_finite_value_is_refused(name: str, field: str, value: float) -> None:
    decode, make = DECODERS[name]
    message = make()
    set_field(message, field, value)
    with pytest.raises(ProtocolError):
        decode(message.encode())


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("joints.1.parent", 1, "parent 1"),
        ("joints.1.parent", 3, "parent 3"),
        ("joints.0.parent", -2, "parent -2"),
        ("joints.1.rest_rotation.0", 2.0, "unit length"),
        ("joints.1.yield_torque", math.nan, "yield torque"),
        ("physics_hz", 0.0, "physics_hz"),
        ("pose_hz", -60.0, "pose_hz"),
        ("joint_count", 0, "0 joints"),
    ],
)
def test_decode_character_with_impossible_value_is_refused(field: str, value: float, reason: str) -> None:
    message = synthetic.character_message()
    set_field(message, field, value)
    with pytest.raises(ProtocolError, match=reason):
        codec.decode_character(message.encode())


def test_decode_character_infinite_yield_torque_is_kept() -> None:
    character = codec.decode_character(synthetic.character_message().encode())
    assert character.joints[0].yield_torque == math.inf


def test_decode_pose_zero_quaternion_is_refused() -> None:
    message = synthetic.pose_message(0)
    message.rotations[1] = [0.0] * 4
    with pytest.raises(ProtocolError, match="unit length"):
        codec.decode_pose(message.encode())


def test_decode_pose_float_rounding_is_renormalised() -> None:
    message = synthetic.pose_message(0)
    message.rotations[1] = [1.0001 * component for component in message.rotations[1]]
    rotations = codec.decode_pose(message.encode()).rotations
    np.testing.assert_allclose(np.linalg.norm(rotations, axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize(("index", "total"), [(3, 3), (-1, 3), (0, 0)])
def test_decode_mesh_chunk_outside_its_total_is_refused(index: int, total: int) -> None:
    chunk = synthetic.chunk_messages()[0]
    chunk.index, chunk.total = index, total
    with pytest.raises(ProtocolError, match="mesh chunk"):
        codec.decode_mesh_chunk(chunk.encode())


def break_triangle(mesh: object) -> None:
    mesh.triangles[0][1] = 100000  # type: ignore[attr-defined]


def break_joint(mesh: object) -> None:
    mesh.joint_indices[5][0] = 4  # type: ignore[attr-defined]


def break_point(mesh: object) -> None:
    mesh.points[7][2] = math.nan  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("damage", "reason"), [(break_triangle, "vertex index"), (break_joint, "joint index"), (break_point, "points")]
)
def test_decode_meshes_with_impossible_value_is_refused(damage: Callable[[object], None], reason: str) -> None:
    message = synthetic.meshes_message()
    damage(message.meshes[0])
    with pytest.raises(ProtocolError, match=reason):
        codec.decode_meshes(message.encode(), joint_count=4)


def test_encode_command_round_trip_keeps_everything() -> None:
    arguments = (Argument("bone", text="Hand"), Argument("point", values=(0.5, -1.0, 2.0)))
    data = codec.encode_command(Command(123, 9, "me", 7, "grab", arguments))
    raw = messages.command_t.decode(data)
    assert (raw.protocol_version, raw.time_us, raw.server_id, raw.client_id) == (1, 123, 9, "me")
    assert (raw.sequence, raw.name) == (7, "grab")
    assert [(a.name, a.text, list(a.values)) for a in raw.arguments] == [
        ("bone", "Hand", []),
        ("point", "", [0.5, -1.0, 2.0]),
    ]


def test_encode_pointer_round_trip_keeps_everything() -> None:
    pointer = Pointer(123, 9, "me", 7, 1, np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0, 0.0]))
    raw = messages.pointer_t.decode(codec.encode_pointer(pointer))
    assert (raw.protocol_version, raw.server_id, raw.client_id, raw.sequence, raw.pointer) == (1, 9, "me", 7, 1)
    assert (list(raw.position), list(raw.rotation)) == ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0, 0.0])
