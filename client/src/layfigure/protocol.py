"""What goes over the wire, as plain immutable data.

Units are SI, the world is Z up, quaternions are w x y z and map the joint's frame to its parent's (a root's: to the
world). Arrays are NumPy's; their shapes stand in the comments, with J joints, V vertices, T triangles, W wedges, K
influences.
The .lcm files under server/messaging/types are the reference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from layfigure.errors import ProtocolError

PROTOCOL_VERSION = 1

CHARACTER_CHANNEL = "LAYFIGURE_CHARACTER"
MESH_CHANNEL = "LAYFIGURE_MESH"
POSE_CHANNEL = "LAYFIGURE_POSE"
POINTER_CHANNEL = "LAYFIGURE_POINTER"
FORCE_CHANNEL = "LAYFIGURE_FORCE"
COMMAND_CHANNEL = "LAYFIGURE_COMMAND"
REPLY_CHANNEL = "LAYFIGURE_REPLY"
STATUS_CHANNEL = "LAYFIGURE_STATUS"
SPIDAR_STATE_CHANNEL = "SPIDAR_STATE"
SPIDAR_COMMAND_CHANNEL = "SPIDAR_COMMAND"

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Joint:
    name: str
    parent: int  # index of an earlier joint, -1 for a root
    rest_translation: Floats  # (3) in the parent joint's frame; a root's: in the world [m]
    rest_rotation: Floats  # (4)
    bind_translation: Floats  # (3) in the world [m]
    bind_rotation: Floats  # (4) joint -> world
    is_body: bool  # False: it rides rigidly on its parent
    mass: float  # [kg]
    stiffness: float  # [N m/rad]
    yield_torque: float  # [N m], infinity for an elastic joint


@dataclass(frozen=True, eq=False)
class Character:
    time_us: int
    server_id: int
    name: str
    source_file: str
    source_folder: str  # of that file, absolute, on the server's machine; "": not told
    content_hash: int
    physics_hz: float
    pose_hz: float
    clock: str  # "realtime" or "lockstep"
    mesh_bytes: int
    joints: tuple[Joint, ...]  # parents before children


@dataclass(frozen=True, eq=False)
class Image:
    """A picture that the character's file holds."""

    name: str  # for people
    format: str  # "png", "jpg", "tga" or what else the file says
    data: bytes


@dataclass(frozen=True, eq=False)
class Material:
    """Its base colour texture is a file (`texture`), or `image`, or there is none."""

    name: str  # may be empty, or another's too
    base_color: Floats  # (3) linear RGB, times the texture's
    opacity: float  # 0 to 1, times the texture's alpha if that counts
    texture_alpha: bool  # it counts
    alpha_cutoff: float  # > 0: what has less alpha is not there, all else is opaque
    texture: str  # path from the character's source_folder unless absolute, as its file names it
    image: Image | None
    wrap: tuple[str, str]  # along u and v, outside of 0 to 1: "repeat", "clamp" or "mirror"


@dataclass(frozen=True, eq=False)
class Mesh:
    """A wedge is a vertex with one normal and one texture coordinate, as one or more corners of triangles have it;
    wedge k is of vertex k, where there are so many."""

    name: str
    material: Material | None  # one object for all meshes that have it
    points: Floats32  # (V, 3) in the bind pose, world [m]
    triangles: Ints  # (T, 3)
    joint_indices: Ints  # (V, K)
    joint_weights: Floats32  # (V, K), each row sums to 1
    normals: Floats32 | None  # (W, 3) unit, world; None: the character's file has none
    uvs: Floats32 | None  # (W, 2), (0, 0) is the texture's lower left corner; None: there are none
    wedges: Ints  # (T, 3) of each triangle's corners


@dataclass(frozen=True)
class MeshChunk:
    server_id: int
    content_hash: int
    index: int
    total: int
    data: bytes


@dataclass(frozen=True, eq=False)
class Pose:
    time_us: int  # simulation time
    server_id: int
    content_hash: int
    sequence: int
    step: int
    root_translation: Floats  # (3) [m]
    rotations: Floats  # (J, 4)
    rest_rotations: Floats  # (J, 4)
    torques: Floats  # (J, 3) [N m]
    yielded: Bools  # (J)


@dataclass(frozen=True, eq=False)
class Force:
    time_us: int
    server_id: int
    sequence: int
    pointer: int
    tool: str  # "none", "grab" or "touch"
    attached: bool  # a tool is out
    contact: bool  # it grabs, or its fingertip touches something
    joint: int  # held or touched, -1: none
    position: Floats  # (3) of the held point or the fingertip, world [m]
    target: Floats  # (3) of the pointer, world [m]
    force: Floats  # (3) on the doll or the fingertip, world [N]
    torque: Floats  # (3) about the held point, world [N m]
    hand_force: Floats  # (3) that the hand is to feel, in the frame of its own poses [N]
    hand_torque: Floats  # (3) [N m]


@dataclass(frozen=True)
class Device:
    """A haptic device of the server."""

    name: str
    pointer: int
    state: str  # "ok", or why it has no force
    last_fault: str
    faults: int
    share: float  # of the force that is let through, 0 to 1
    reach: float  # 0 middle of its workspace .. 1 border
    turn: float  # likewise, of its rotation
    energy: float  # that its hand has put in, J
    haptic_hz: float  # at which it is to be served, in simulation time
    haptic_rate: float  # reached over the last second or two
    late_ticks: int
    tick_us_p50: float
    tick_us_p99: float
    tick_us_max: float
    realtime: bool  # its ticks are scheduled in real time


@dataclass(frozen=True)
class Status:
    time_us: int
    server_id: int
    state: str  # "running", "failed" or "leaving"
    detail: str
    clock: str
    content_hash: int
    steps: int
    poses: int
    late_steps: int
    dropped_time: float  # [s] of simulation, given up as steps fell too far behind
    step_us_p50: float
    step_us_p99: float
    step_us_max: float
    realtime_factor: float
    yielding_joints: int
    kinetic_energy: float  # [J]
    elastic_energy: float  # [J]
    bad_messages: int
    dropped_messages: int
    paused_clients: int
    clients: int
    max_clients: int
    max_message_bytes: int
    max_message_rate: float
    devices: tuple[Device, ...]


@dataclass(frozen=True)
class Argument:
    """A named value of a command or of a reply: a text, numbers, or both."""

    name: str
    text: str = ""
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class Reply:
    time_us: int
    server_id: int
    client_id: str
    sequence: int
    accepted: bool
    reason: str
    results: tuple[Argument, ...]

    @property
    def marks_key(self) -> bool:
        """Whether a `key` command was carried out: its reply alone tells which pose was the newest."""
        return self.accepted and {result.name for result in self.results} == {"time_us", "pose"}

    def values(self, name: str) -> tuple[float, ...]:
        """The numbers of a result. Raises ProtocolError if the reply has none of that name."""
        for result in self.results:
            if result.name == name and result.values:
                return result.values
        raise ProtocolError(f"the server's reply holds no '{name}'")


@dataclass(frozen=True)
class Command:
    time_us: int
    server_id: int  # 0: the only one
    client_id: str
    sequence: int
    name: str
    arguments: tuple[Argument, ...] = ()


@dataclass(frozen=True, eq=False)
class Pointer:
    time_us: int
    server_id: int  # 0: the only one
    client_id: str
    sequence: int
    pointer: int
    position: Floats  # (3) [m]
    rotation: Floats  # (4) pointer -> world


@dataclass(frozen=True, eq=False)
class SpidarState:
    """What a haptic device has measured: its strings' lengths, or the pose of its grip, in the device's frame (x right,
    y away from the user, z up); neither if it rejects what it measures."""

    time_us: int
    device_id: str
    sequence: int
    lengths: Floats | None = None  # (8) [m]
    position: Floats | None = None  # (3) [m]
    rotation: Floats | None = None  # (4) grip -> device
    grip: float = 0.0  # 0 open .. 1 squeezed
    buttons: int = 0


@dataclass(frozen=True, eq=False)
class SpidarCommand:
    """What a haptic device is to exert until the next command, or for 10 ms if none comes."""

    time_us: int
    device_id: str
    sequence: int
    state_sequence: int
    active: bool  # False: let go
    tensions: Floats | None  # (8) [N], of a device that tells lengths
    force: Floats  # (3) on the hand, device frame [N]
    torque: Floats  # (3) about the grip's origin [N m]
