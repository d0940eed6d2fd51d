"""A live doll's history beside Blender's undo, mirror and snapshots, in Blender's own Python.

python history_scenes.py NAME FOLDER
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import world
from key_support import MOVED, RESTS_AGAIN, curves_of, farthest, is_refused, live_doll, place_of, poses_of
from layfigure_blender import operators_history, sessions


def mirror_and_snapshots(_: Path) -> None:
    session, armature = live_doll()
    world.drag(session, "hand.L", np.array([0.0, -0.15, 0.25]))
    lifted = poses_of(armature)
    place = session.place
    assert bpy.ops.layfigure.snapshot_save(name="lifted") == {"FINISHED"}
    known = bpy.context.window_manager.layfigure_snapshots
    assert [each.name for each in known.names] == ["lifted"]
    assert known.of == session.id
    assert bpy.ops.layfigure.mirror(side="both") == {"FINISHED"}
    assert armature.layfigure.place == session.place != place
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) > MOVED
    assert bpy.ops.layfigure.snapshot_restore() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) < 1e-3  # it comes to rest anew
    assert bpy.ops.layfigure.undo() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) > MOVED
    assert bpy.ops.layfigure.redo() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) < 1e-3
    assert "nothing to do again" in is_refused(bpy.ops.layfigure.redo)
    assert bpy.ops.layfigure.snapshot_save(name="second") == {"FINISHED"}
    assert [each.name for each in known.names] == ["lifted", "second"]
    assert known.active == 1
    assert bpy.ops.layfigure.snapshot_remove(name="lifted") == {"FINISHED"}
    assert [each.name for each in known.names] == ["second"]
    assert known.active == 0
    assert "there is no snapshot 'lifted'" in is_refused(bpy.ops.layfigure.snapshot_restore, name="lifted").lower()
    assert "expected 1 to 64" in is_refused(bpy.ops.layfigure.snapshot_save, name=" ")
    assert "expected 1 to 64" in is_refused(bpy.ops.layfigure.snapshot_save, name="x" * 65)
    assert bpy.ops.layfigure.snapshot_remove() == {"FINISHED"}
    assert not bpy.ops.layfigure.snapshot_restore.poll()


def snapshots_of_before_are_listed_by_themselves(_: Path) -> None:
    session, _ = live_doll()
    assert bpy.ops.layfigure.snapshot_save(name="kept") == {"FINISHED"}
    bpy.ops.layfigure.stop()
    armature = bpy.context.object
    session = world.start(armature)
    known = bpy.context.window_manager.layfigure_snapshots

    def is_listed() -> bool:
        operators_history.take_lists()  # as its timer does
        return known.of == session.id

    world.wait(is_listed, "the list")
    assert [each.name for each in known.names] == ["kept"]
    bpy.ops.layfigure.snapshot_remove(name="kept")


def undo_many_times_in_a_row(_: Path) -> None:
    """As with Ctrl Z held down: nothing is waited for in between."""
    session, armature = live_doll()
    bpy.ops.ed.undo_push(message="Start")
    session.note_place()
    states = []
    for k in range(6):
        world.drag(session, ("hand.L", "hand.R")[k % 2], np.array([0.0, -0.08 - 0.03 * k, 0.1 + 0.03 * k]), 0.3)
        session.note_place()
        states.append((session.place, poses_of(armature)))
        bpy.ops.ed.undo_push(message=f"drag {k}")
    for _k in range(5):
        bpy.ops.ed.undo()
    session = sessions.all()[0]
    armature = session.armature()
    assert armature.layfigure.place == states[0][0]
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert farthest(states[0][1], poses_of(armature)) < RESTS_AGAIN
    assert place_of(session) == states[0][0]
    for _k in range(3):
        bpy.ops.ed.redo()
    armature = session.armature()
    world.wait(lambda: session.live, "the doll's way on")
    world.settle(session)
    assert farthest(states[3][1], poses_of(armature)) < RESTS_AGAIN
    assert place_of(session) == states[3][0]
    # what is done now is a branch of its own, for both
    assert bpy.ops.layfigure.mirror() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="mirror")
    bpy.ops.ed.undo()
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert place_of(session) == states[3][0]


def undo_while_the_doll_is_held(_: Path) -> None:
    session, armature = live_doll()
    session.note_place()
    before = poses_of(armature)
    bpy.ops.ed.undo_push(message="Start")
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    session.note_place()
    bpy.ops.ed.undo_push(message="drag")
    link = session.link
    place = world.layfigure.world_poses(link.character, link.newest.pose)[1][session.bones.joint_of_bone("hand.R")]
    link.move_pointer(0, place)
    link.send("grab", pointer=0, bone="hand.R").result(world.TIMEOUT_S)
    link.move_pointer(0, place + np.array([0.0, -0.2, 0.2]))
    world.wait(lambda: link.forces and link.forces[0].attached, "the grab")
    bpy.ops.ed.undo()
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN
    world.wait(lambda: not link.forces[0].attached, "letting go")
    link.move_pointer(0, place)  # the hand that has lost the doll goes on: nothing happens
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN


def undo_of_a_key_leaves_the_doll(_: Path) -> None:
    session, armature = live_doll()
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    session.note_place()
    bpy.ops.ed.undo_push(message="drag")
    before = poses_of(armature)
    bpy.ops.layfigure.key_pose("EXEC_DEFAULT", True)
    assert curves_of(session.armature())
    bpy.ops.ed.undo()
    assert curves_of(session.armature()) == []
    world.wait(lambda: session.live, "the doll")
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN


if __name__ == "__main__":
    world.run_scene(globals())
