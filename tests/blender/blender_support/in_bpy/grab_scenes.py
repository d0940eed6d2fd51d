"""Runs inside Blender's Python: what the mouse finds in a 3D view, in Blender's own numbers, and what it does there.

python grab_scenes.py SCENE
"""

from __future__ import annotations

import sys
import time
from types import SimpleNamespace

import bpy
import numpy as np
import world
from bpy_extras import view3d_utils
from layfigure_blender import overlay, seen_dolls, sessions
from layfigure_blender.grab import Grab, Outcome, Phase, free_pointer
from mathutils import Matrix, Vector

NAMES = ["root", "lower", "middle", "upper"]
ON_SPOT = 0.01  # [pixels]: Blender's matrices are of single precision
TIMEOUT_S = 60.0  # for a machine under load; never waited for in a test that passes


class InView:
    """A context in a 3D view of the window that bpy keeps though nobody sees it, with matrices of its own: nothing is
    drawn here, from which Blender would have them."""

    def __init__(self, *, perspective: bool = True) -> None:
        window = bpy.context.window_manager.windows[0]
        area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
        self.region = next(region for region in area.regions if region.type == "WINDOW")
        self.space_data = area.spaces.active
        self.preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))  # which is 0 without a window
        self.region_data = _region_data(self.region.width / self.region.height, perspective)

    @property
    def object(self) -> bpy.types.Object | None:
        return bpy.context.object

    def seen_at(self, point: Vector) -> np.ndarray:
        """Where Blender itself draws a point of its world."""
        return np.array(view3d_utils.location_3d_to_region_2d(self.region, self.region_data, point))

    def direction(self, pixel: np.ndarray) -> np.ndarray:
        """Away from who looks, by Blender itself."""
        return np.array(view3d_utils.region_2d_to_vector_3d(self.region, self.region_data, pixel))


def _region_data(aspect: float, perspective: bool) -> SimpleNamespace:
    """From 4 m, above and aside."""
    turn = Matrix.Rotation(0.4, 4, "Z") @ Matrix.Rotation(1.2, 4, "X")
    view = (Matrix.Translation((0.1, 0.0, 0.6)) @ turn @ Matrix.Translation((0.0, 0.0, 4.0))).inverted()
    if perspective:
        rows = [(2.0, 0, 0, 0), (0, 2.0 * aspect, 0, 0), (0, 0, -1.0002, -0.02), (0, 0, -1, 0)]
    else:
        rows = [(0.5, 0, 0, 0), (0, 0.5 * aspect, 0, 0), (0, 0, -0.001, 0), (0, 0, 0, 1)]
    window = Matrix(rows)
    return SimpleNamespace(
        view_matrix=view, window_matrix=window, perspective_matrix=window @ view, is_perspective=perspective
    )


def live_chain(scale: float = 1.0, *, turned: bool = False) -> tuple[bpy.types.Object, sessions.Session]:
    world.empty_file()
    armature = world.chain(NAMES)
    world.place(armature, scale, turned=turned)
    session = world.start(armature)
    world.settle(session)
    bpy.context.view_layer.update()  # as Blender's window does between the timer and what is drawn
    return armature, session


def head(armature: bpy.types.Object, bone: str) -> Vector:
    bpy.context.view_layer.update()
    return armature.matrix_world @ armature.pose.bones[bone].head


def scene_view_is_blenders_own() -> None:
    for perspective in (True, False):
        armature, session = live_chain(1.5, turned=True)
        for moved in (False, True):  # after Start, the doll's world is no longer Blender's
            if moved:
                armature.location += Vector((0.2, -0.1, 0.15))
                armature.rotation_euler.z += 0.7
                bpy.context.view_layer.update()
            context = InView(perspective=perspective)
            view = seen_dolls.view_of(context, session)
            heads, _ = seen_dolls.segments(session, NAMES)
            for name, place in zip(NAMES, heads, strict=True):
                pixel = context.seen_at(head(armature, name))
                assert np.abs(view.pixels(place) - pixel).max() < ON_SPOT, (perspective, moved, name)
                along = context.direction(pixel)
                turned = session.world_to_server()[:3, :3] @ along
                assert np.abs(view.ray(pixel)[1] - turned / np.linalg.norm(turned)).max() < 1e-4
        session.stop()


def scene_bone_under_the_mouse_is_found_where_it_is_drawn() -> None:
    armature, session = live_chain()
    armature.show_in_front = True
    context = InView()
    middle = 0.5 * (head(armature, "upper") + head(armature, "middle"))
    pixel = context.seen_at(middle)
    target = seen_dolls.target_under(context, tuple(pixel))
    assert target is not None
    assert [tuple(way) for way in target.ways] == [("bone", "point"), ("origin", "direction")]
    assert target.ways[0]["bone"] == "middle"
    assert abs(np.linalg.norm(target.ways[0]["point"]) - 0.15) < 1e-4
    posed = armature.pose.bones["middle"]
    (posed if hasattr(posed, "hide") else posed.bone).hide = True  # of the pose since 5.0
    hidden = seen_dolls.target_under(context, tuple(pixel))
    assert hidden is not None
    assert all("bone" not in way for way in hidden.ways), "a hidden bone is not taken hold of"
    session.stop()


def scene_what_is_hidden_is_not_taken_hold_of() -> None:
    armature, session = live_chain()
    [skin] = [item for item in bpy.data.objects if item.type == "MESH"]
    context = InView()
    pixel = tuple(context.seen_at(head(armature, "upper")))
    ways = seen_dolls.target_under(context, pixel).ways
    assert [next(iter(way)) for way in ways] == ["origin", "bone"], "the skin is in front"
    armature.hide_set(True)
    assert [next(iter(way)) for way in seen_dolls.target_under(context, pixel).ways] == ["origin"]
    skin.hide_set(True)
    assert seen_dolls.target_under(context, pixel) is None
    armature.hide_set(False)
    assert [next(iter(way)) for way in seen_dolls.target_under(context, pixel).ways] == ["bone"]
    context.space_data.overlay.show_bones = False
    assert seen_dolls.target_under(context, pixel) is None
    context.space_data.overlay.show_bones = True
    session.stop()


def scene_nearer_of_two_dolls_is_meant() -> None:
    first, session = live_chain()
    second = world.chain(NAMES)
    second.location.x = 0.8
    bpy.context.view_layer.update()
    other = world.start(second)
    context = InView()
    for armature, owner in ((first, session), (second, other)):
        pixel = tuple(context.seen_at(head(armature, "upper")))
        assert seen_dolls.target_under(context, pixel).session is owner
    session.stop()
    other.stop()


def kinds_of_ways(context: InView, pixel: np.ndarray) -> list[str]:
    target = seen_dolls.target_under(context, tuple(pixel))
    return [next(iter(way)) for way in target.ways]


def scene_doll_is_not_taken_hold_of_through_a_wall() -> None:
    armature, session = live_chain(1.5, turned=True)
    armature.location += Vector((0.1, -0.1, 0.05))
    bpy.context.view_layer.update()
    bone = 0.5 * (head(armature, "upper") + head(armature, "middle"))
    for perspective in (True, False):
        context = InView(perspective=perspective)
        pixel = context.seen_at(bone)
        to_eye = -Vector(context.direction(pixel))
        assert kinds_of_ways(context, pixel) == ["origin", "bone"]
        bpy.ops.mesh.primitive_cube_add(size=0.3, location=bone + 1.5 * to_eye)
        wall = bpy.context.object
        wall.name = "wall"
        world.select(armature)
        target = seen_dolls.target_under(context, tuple(pixel))
        assert target is not None, "a click selects the wall"
        assert len(target.ways) == 0
        assert "'wall'" in target.why_none
        assert "X-ray" in target.why_none
        a_click_holds_nothing_but_tells_why(session, target, pixel)

        armature.show_in_front = True
        assert kinds_of_ways(context, pixel) == ["bone"], "what is seen through the wall"
        armature.show_in_front = False
        context.space_data.shading.show_xray = True
        assert kinds_of_ways(context, pixel) == ["bone", "origin"]
        context.space_data.shading.show_xray = False
        for change, back in (
            ("wall.display_type = 'WIRE'", "wall.display_type = 'TEXTURED'"),
            ("wall.hide_set(True)", "wall.hide_set(False)"),
            ("wall.location = bone - 1.5 * to_eye", "wall.location = bone + 1.5 * to_eye"),
            ("wall.parent = armature", "wall.parent = None"),
            ("wall.rotation_euler.z = 0.5; wall.location.x += 1.0", "wall.location = bone + 1.5 * to_eye"),
        ):
            names = {"wall": wall, "bone": bone, "to_eye": to_eye, "armature": armature}
            exec(change, names)
            if wall.parent is not None:
                wall.matrix_world = Matrix.Translation(bone + 1.5 * to_eye)
            bpy.context.view_layer.update()
            assert kinds_of_ways(context, pixel) == ["origin", "bone"], (change, perspective)
            exec(back, names)
            bpy.context.view_layer.update()
        assert kinds_of_ways(context, pixel) == []
        bpy.data.objects.remove(wall)
    session.stop()


def a_click_holds_nothing_but_tells_why(
    session: sessions.Session, target: seen_dolls.Target, pixel: np.ndarray
) -> None:
    def pressed() -> Grab:
        pins = overlay.pins_of(session)
        return Grab(session.link, pins, 15, target.ways, pixel, 0.0, click_radius=3.0, why_no_way=target.why_none)

    click = pressed()
    click.release()
    assert click.outcome is Outcome.CLICKED
    drag = pressed()
    drag.mouse(target.view, pixel + 20.0)
    drag.release()
    assert (drag.phase, drag.outcome, drag.note) == (Phase.ENDED, Outcome.MISSED, target.why_none)


def scene_doll_in_front_of_another_is_meant() -> None:
    """Even where a bone of the hidden one is drawn nearer to the mouse."""
    armature, session = live_chain()
    context = InView()
    bone = 0.5 * (head(armature, "upper") + head(armature, "middle"))
    pixel = context.seen_at(bone)
    front = world.chain(NAMES, radius=0.1)
    front.location = -1.5 * Vector(context.direction(pixel)) + Vector((0.04, 0.0, 0.0))
    bpy.context.view_layer.update()
    other = world.start(front)
    world.settle(other)
    bpy.context.view_layer.update()
    assert seen_dolls.target_under(context, tuple(pixel)).session is other
    session.stop()
    other.stop()


def scene_drag_moves_the_bone_that_is_seen() -> None:
    armature, session = live_chain(2.0, turned=True)
    armature.show_in_front = True
    armature.location += Vector((0.1, 0.2, 0.0))
    bpy.context.view_layer.update()
    context = InView()
    tip = armature.matrix_world @ armature.pose.bones["upper"].tail
    start = context.seen_at(tip)
    target = seen_dolls.target_under(context, tuple(start))
    link = session.link
    pointer = free_pointer(link.status, link.forces)
    grab = Grab(link, overlay.pins_of(session), pointer, target.ways, start, 0.0, click_radius=3.0)
    grab.soften()
    end = start + np.array([150.0, -40.0])
    for share in np.linspace(0.0, 1.0, 60):
        grab.mouse(seen_dolls.view_of(context, session), start + share * (end - start))
        grab.poll(0.0)
        sessions.tick()
        time.sleep(0.01)
    until(grab, Phase.HOLDING)
    world.settle(session)
    bpy.context.view_layer.update()
    now = context.seen_at(armature.matrix_world @ armature.pose.bones["upper"].tail)
    assert np.linalg.norm(now - end) < 0.5 * np.linalg.norm(start - end), (start, now, end)
    grab.release()
    until(grab, Phase.ENDED)
    assert grab.outcome is Outcome.RELEASED
    session.note_place()
    assert armature.layfigure.place > 0
    session.stop()


def scene_watch_forgets_a_stopped_session() -> None:
    _, session = live_chain()
    assert overlay._look() == overlay.LIVE_S
    assert session.id in overlay._watches
    session.stop()
    assert overlay._look() == overlay.IDLE_S
    assert session.id not in overlay._watches
    assert not seen_dolls.posable_sessions()


def until(grab: Grab, phase: Phase) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while grab.phase is not phase:
        assert time.monotonic() < deadline, (grab.phase, grab.outcome, grab.note)
        grab.poll(0.0)
        sessions.tick()
        time.sleep(0.005)


if __name__ == "__main__":
    with world.registered():
        globals()[sys.argv[1]]()
