"""The bytes that the C++ side wrote: both sides must read and write the same."""

from pathlib import Path

import numpy as np
import pytest

from layfigure import codec, messages
from layfigure.protocol import Argument, Command, Pointer, SpidarState

GOLDEN = Path(__file__).parent.parent / "data" / "golden"
SERVER_ID = 0x0123456789ABCDEF
CONTENT_HASH = -81985529216486896
TYPES = [
    "character_t",
    "command_t",
    "force_t",
    "log_devices_t",
    "log_snapshot_t",
    "log_start_t",
    "log_step_t",
    "mesh_chunk_t",
    "meshes_t",
    "pointer_t",
    "pose_t",
    "reply_t",
    "spidar_command_t",
    "spidar_state_t",
    "status_t",
]


def golden(name: str) -> bytes:
    return (GOLDEN / f"{name}.bin").read_bytes()


@pytest.mark.parametrize("name", TYPES)
def test_golden_bytes_decoded_and_encoded_again_are_equal(name: str) -> None:
    data = golden(name)
    assert getattr(messages, name).decode(data).encode() == data


def test_golden_character_decodes_to_its_values() -> None:
    character = messages.character_t.decode(golden("character_t"))  # its quaternions are not of unit length
    assert (character.name, character.clock, character.content_hash) == ("doll", "lockstep", CONTENT_HASH)
    assert [joint.name for joint in character.joints] == ["hips", "Hüfte.L"]
    assert character.joints[0].yield_torque == float("inf")
    assert list(character.joints[1].bind_translation) == [22.0, 22.125, 22.25]


def test_golden_pose_decodes_to_its_values() -> None:
    pose = codec.decode_pose(golden("pose_t"))
    assert (pose.time_us, pose.server_id, pose.content_hash) == (1234567, SERVER_ID, CONTENT_HASH)
    assert (pose.sequence, pose.step) == (42, 701)
    np.testing.assert_array_equal(pose.root_translation, [0.5, 0.625, 0.75])
    np.testing.assert_array_equal(pose.rotations, [[1, 0, 0, 0], [0.5, 0.5, -0.5, 0.5]])
    np.testing.assert_array_equal(pose.torques, [[0, 0.125, 0.25], [-1.5, 2.5, -3.5]])
    np.testing.assert_array_equal(pose.yielded, [False, True])


def test_golden_force_decodes_to_its_values() -> None:
    force = codec.decode_force(golden("force_t"))
    assert (force.pointer, force.attached, force.joint, force.sequence) == (1, True, 3, 42)
    assert (force.tool, force.contact) == ("touch", True)
    np.testing.assert_array_equal(force.force, [-3.0, -2.875, -2.75])
    np.testing.assert_array_equal(force.hand_force, [5.0, 5.125, 5.25])
    np.testing.assert_array_equal(force.hand_torque, [-6.0, -5.875, -5.75])


def test_golden_mesh_decodes_to_its_values() -> None:
    (mesh,) = codec.decode_meshes(golden("meshes_t"), joint_count=2)
    assert mesh.name == "skin"
    np.testing.assert_array_equal(mesh.points, [[0, 0.25, 0.5], [1, 1.25, 1.5], [2, 2.25, 2.5]])
    np.testing.assert_array_equal(mesh.joint_indices, [[0, 1], [1, 0], [0, 0]])
    np.testing.assert_array_equal(mesh.joint_weights, [[0.75, 0.25], [0.5, 0.5], [1, 0]])


def test_golden_looks_decode_to_their_values() -> None:
    (mesh,) = codec.decode_meshes(golden("meshes_t"), joint_count=2)
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, -1, 0]])
    np.testing.assert_array_equal(mesh.uvs, [[0, 0.125], [0.25, 0.375], [0.5, 0.625], [0.75, 0.875]])
    np.testing.assert_array_equal(mesh.wedges, [[3, 1, 2]])
    material = mesh.material
    assert material is not None
    assert (material.name, material.opacity, material.texture_alpha, material.alpha_cutoff) == (
        "Häut",
        0.75,
        True,
        0.25,
    )
    np.testing.assert_array_equal(material.base_color, [0.5, 0.625, 0.75])
    assert (material.texture, material.image, material.wrap) == ("textures/skin.png", None, ("clamp", "mirror"))
    (image,) = messages.meshes_t.decode(golden("meshes_t")).images
    assert (image.name, image.format, bytes(image.bytes)) == ("eye", "png", b"\x89PNG")


def test_golden_mesh_chunk_decodes_to_its_values() -> None:
    chunk = codec.decode_mesh_chunk(golden("mesh_chunk_t"))
    assert (chunk.index, chunk.total, chunk.data) == (2, 5, bytes([0, 1, 127, 128, 255]))


def test_golden_reply_decodes_to_its_values() -> None:
    reply = codec.decode_reply(golden("reply_t"))
    assert (reply.client_id, reply.sequence, reply.accepted) == ("client-1", 7, False)
    assert reply.reason == "no bone is called 'tail'"
    assert reply.results == (Argument("steps", "", (3.0,)), Argument("note", "text", ()))


def test_golden_status_decodes_to_its_values() -> None:
    status = codec.decode_status(golden("status_t"))
    assert (status.state, status.steps, status.realtime_factor, status.dropped_messages) == ("failed", 11, 100.25, 6)
    assert (status.dropped_time, status.paused_clients, status.clients, status.max_clients) == (1.5, 7, 8, 9)
    assert (status.max_message_bytes, status.max_message_rate) == (10, 200.5)
    (device,) = status.devices
    assert (device.pointer, device.state, device.faults, device.share) == (1, "silent", 2, 0.25)
    assert (device.energy, device.haptic_hz, device.haptic_rate, device.late_ticks) == (0.125, 4000.0, 3999.5, 3)
    assert (device.tick_us_p50, device.tick_us_p99, device.tick_us_max, device.realtime) == (8.0, 16.0, 64.0, True)


def test_golden_spidar_command_decodes_to_its_values() -> None:
    command = codec.decode_spidar_command(golden("spidar_command_t"))
    assert (command.device_id, command.sequence, command.state_sequence) == ("left", 9, 10)
    assert command.active
    assert command.tensions is None
    np.testing.assert_array_equal(command.force, [-2.0, -1.875, -1.75])
    np.testing.assert_array_equal(command.torque, [3.0, 3.125, 3.25])


def test_golden_spidar_state_is_that_of_a_device_process() -> None:
    state = messages.spidar_state_t.decode(golden("spidar_state_t"))
    pose = SpidarState(
        time_us=1234567,
        device_id="left",
        sequence=10,
        position=np.array([-0.5, -0.375, -0.25]),
        rotation=np.array([0.5, -0.5, 0.5, 0.5]),
        grip=0.75,
        buttons=5,
    )
    raw = messages.spidar_state_t.decode(codec.encode_spidar_state(pose))
    assert list(raw.lengths) == [0.0] * 8
    raw.lengths = state.lengths  # which do not hold
    assert raw.encode() == golden("spidar_state_t")


def test_golden_command_is_what_the_client_sends() -> None:
    arguments = (Argument("bone", "Hüfte.L"), Argument("point", "", (0.5, -0.25, 1e-3)))
    assert codec.encode_command(Command(1234567, 0, "client-1", 7, "grab", arguments)) == golden("command_t")


def test_golden_pointer_is_what_the_client_sends() -> None:
    position, rotation = np.array([-0.5, -0.375, -0.25]), np.array([0.5, -0.5, 0.5, 0.5])
    assert codec.encode_pointer(Pointer(1234567, 0, "client-1", 8, 1, position, rotation)) == golden("pointer_t")
