"""What may happen to a session, and how it ends, one scene in each process.

python fault_scenes.py NAME FOLDER
"""

from __future__ import annotations

import os
import signal
from pathlib import Path

import bpy
import layfigure_blender
import numpy as np
import world
from layfigure_blender import blender_events, sessions
from session_support import NAMES, constrained, evaluated, expect_following, expect_released, expect_same, is_running


def file_that_is_saved_meanwhile_has_its_constraints(folder: Path) -> None:
    armature = world.chain(NAMES)
    moving = constrained(armature)
    session = world.start(armature)
    path = folder / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert all(item.mute for item in moving), "the doll is still live"
    pid = session.server_pid
    world.drag(session, "tip", np.array([-0.2, 0.3, -0.1]))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert not sessions.all()
    assert not is_running(pid)
    armature = bpy.data.objects["chain"]
    expect_released(armature)
    sessions.tick()
    world.drag(world.start(armature), "tip", np.array([-0.2, 0.3, -0.1]))


def file_of_a_crash_is_mended_when_it_is_loaded(folder: Path) -> None:
    """Blender's autosave runs no handlers."""
    armature = world.chain(NAMES)
    constrained(armature)
    world.start(armature)
    path = folder / "autosaved.blend"
    bpy.app.handlers.save_pre.remove(blender_events._before_saving)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.app.handlers.save_pre.append(blender_events._before_saving)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    expect_released(bpy.data.objects["chain"])


def server_that_is_killed_is_told_and_started_again(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    posed = evaluated(armature)
    os.kill(session.server_pid, signal.SIGKILL)
    world.wait(lambda: session.failed, "the loss")
    world.wait(lambda: "killed by signal 9" in session.message, "the reason")
    assert "Reconnect" in session.message
    for _ in range(5):
        sessions.tick()
    expect_same(evaluated(armature), posed)
    assert bpy.ops.layfigure.reconnect() == {"FINISHED"}
    world.wait(lambda: session.live, "the doll")
    world.settle(session)
    expect_same(evaluated(armature), posed)
    world.drag(session, "tip", np.array([-0.2, 0.1, -0.2]))
    expect_following(session, armature)


def server_that_is_killed_while_it_loads_ends_the_start(_: Path) -> None:
    armature = world.chain(NAMES)
    assert bpy.ops.layfigure.start() == {"FINISHED"}
    os.kill(sessions.of(armature).server_pid, signal.SIGKILL)
    world.wait(lambda: not sessions.all(), "the end")
    assert "killed by signal 9" in sessions.last_words(armature)
    world.start(armature)


def armature_that_is_deleted_ends_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    pid = session.server_pid
    bpy.data.objects.remove(armature)
    sessions.tick()
    assert not sessions.all()
    assert not is_running(pid)
    armature = world.chain([name + "2" for name in NAMES])
    session = world.start(armature)
    bpy.context.scene.collection.objects.unlink(armature)
    sessions.tick()
    assert not sessions.all()


def armature_that_is_renamed_goes_on(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    armature.name = "another"
    bpy.data.objects.new("chain", None)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    assert sessions.of(armature) is session


def duplicate_of_an_armature_is_free(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    bpy.ops.object.duplicate()
    double = bpy.context.object
    assert double != armature
    assert sessions.of(double) is None
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    rest = np.array([bone.matrix_local for bone in double.data.bones])
    expect_same(evaluated(double), rest)
    session.stop()
    assert not double.layfigure.session


def bones_that_are_edited_end_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    world.start(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    for _ in range(5):
        sessions.tick()
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert len(sessions.all()) == 1, "nothing was edited"
    bpy.ops.object.mode_set(mode="EDIT")
    sessions.tick()
    armature.data.edit_bones["tip"].roll += 0.5
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert not sessions.all()
    assert "bones were edited" in sessions.last_words(armature)
    world.start(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.remove(armature.data.edit_bones["tip"])
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert not sessions.all()


def file_that_is_loaded_anew_ends_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    pid, folder = session.server_pid, session.character.parent
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not sessions.all()
    assert not is_running(pid)
    assert not folder.exists()
    assert sessions.tick() is None
    world.start(world.chain(NAMES))


def extension_that_is_unregistered_ends_all(_: Path) -> None:
    armature = world.chain(NAMES)
    moving = constrained(armature)
    pid = world.start(armature).server_pid
    layfigure_blender.unregister()
    assert not is_running(pid)
    assert not any(item.mute for item in moving)
    layfigure_blender.register()
    assert not armature.layfigure.session
    world.start(armature)


def registration_leaves_nothing_behind(_: Path) -> None:
    layfigure_blender.unregister()
    before = traces()
    for _ in range(3):
        layfigure_blender.register()
        assert traces() != before
        layfigure_blender.unregister()
        assert traces() == before
    layfigure_blender.register()


def traces() -> dict:
    handlers = {
        name: [str(handler) for handler in getattr(bpy.app.handlers, name)]
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
    }
    types = [item for name in dir(bpy.types) if isinstance(item := getattr(bpy.types, name), type)]
    subclasses = {cls.__name__ for base in (bpy.types.Operator, bpy.types.Panel) for cls in base.__subclasses__()}
    return {
        "types": sorted(dir(bpy.types)),
        "attributes": sorted(
            (cls.__name__, name) for cls in types for name in vars(cls) if name.startswith("layfigure")
        ),
        "properties": sorted(
            (cls.__name__, name)
            for cls in types
            if hasattr(cls, "bl_rna")
            for name in cls.bl_rna.properties.keys()  # noqa: SIM118
            if "layfigure" in name
        ),
        "operators": [name for name in dir(bpy.ops) if "layfigure" in name and dir(getattr(bpy.ops, name))],
        "registered": sorted(name for name in subclasses if hasattr(bpy.types, name) and "LAYFIGURE" in name),
        "handlers": handlers,
        "timer": bpy.app.timers.is_registered(sessions.tick),
        "listeners": [len(sessions._listeners), len(sessions._settings_sources)],
    }


if __name__ == "__main__":
    world.run_scene(globals())
