"""Client of the Layfigure server: record, play, check and draw the takes of an elasto-plastic doll.

    with layfigure.connect("tcpq://127.0.0.1:7700") as doll:
        doll.command("grab", pointer=0, bone="hand.L")
        for pose in doll.poses(timeout_s=2.0):
            pose.rotations  # (J, 4)

    layfigure.write_usd(layfigure.read_take("take.lcmlog"), "take.usda")

What is named here is what programs may rely on; `layfigure.doll` tells units, frames and threads. `client/examples` of
the repository holds whole programs.
"""

from layfigure.connection import PendingReply
from layfigure.doll import Doll, connect, world_poses
from layfigure.errors import (
    BusError,
    LayfigureError,
    NoReplyError,
    ProtocolError,
    RefusedError,
    TwoServersError,
    UsageError,
)
from layfigure.pose_stream import PoseStream
from layfigure.protocol import Argument, Character, Device, Force, Joint, Mesh, Pose, Reply, Status
from layfigure.recording import Recording
from layfigure.session import Session
from layfigure.session_file import load_session
from layfigure.take import PointerTrack, Take
from layfigure.take_collector import read_take
from layfigure.take_usd import write_usd

__version__ = "0.1.0"

__all__ = [
    "Argument",
    "BusError",
    "Character",
    "Device",
    "Doll",
    "Force",
    "Joint",
    "LayfigureError",
    "Mesh",
    "NoReplyError",
    "PendingReply",
    "PointerTrack",
    "Pose",
    "PoseStream",
    "ProtocolError",
    "Recording",
    "RefusedError",
    "Reply",
    "Session",
    "Status",
    "Take",
    "TwoServersError",
    "UsageError",
    "connect",
    "load_session",
    "read_take",
    "world_poses",
    "write_usd",
]
