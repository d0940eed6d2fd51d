"""Writes a take as USD: in one file, or a small root layer over a character layer and an animation layer.

    OUT.usda            references OUT.character.usdc, sublayers OUT.anim.usdc
    OUT.character.usdc  SkelRoot, Skeleton, skinned meshes, materials
    OUT.anim.usdc       SkelAnimation, yield events, and on request what was felt in each frame
    OUT.textures/       pictures that the character's file holds

Equal takes give equal bytes: nothing is written that depends on the day, the machine or the folder.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

from pxr import Kind, Sdf, Tf, Usd, UsdUtils

from layfigure.animation import Animation, animate
from layfigure.errors import LayfigureError, UsageError
from layfigure.key_reduction import Progress, silent
from layfigure.resample import Frames
from layfigure.take import Take
from layfigure.take_form import TakeForm
from layfigure.usd.animation_layer import set_stage_time, write_animation, write_animation_layer
from layfigure.usd.character_layer import (
    METERS_PER_UNIT,
    STAGE_UP_AXIS,
    character_prim_path,
    set_stage_units,
    write_character,
    write_character_layer,
)
from layfigure.usd.failures import reason
from layfigure.usd.textures import TextureFolder, Textures, hand_over, place_textures, texture_folder
from layfigure.usd.units import rewrite_in_units

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
EVERY_FRAME = TakeForm()
_PACKED_AT = time.mktime((1980, 1, 1, 0, 0, 0, 0, 1, 0))  # zip's first local time: a package keeps its files' dates


def check_output(out: Path) -> None:
    """Raises UsageError if a take cannot be written to `out`: better before the recording than after it."""
    if out.suffix not in SUFFIXES:
        raise UsageError(f"'{out}': the name of a take ends in {', '.join(SUFFIXES)}")
    if not out.parent.is_dir():
        raise UsageError(f"'{out}': there is no folder '{out.parent}'; make it first")
    if out.is_dir():
        raise UsageError(f"'{out}' is a folder: choose a file's name")
    textures = texture_folder(out)
    if textures.exists() and not textures.is_dir():
        raise UsageError(f"'{textures}' is a file, and the folder of the take's pictures is called so: move it away")


def write_take(take: Take, out: Path, fps: float, form: TakeForm = EVERY_FRAME, tell: Progress = silent) -> Animation:
    """Writes all files of a take and returns what is in them. `tell` is told what takes long."""
    animation = animate(take, fps, form, tell)
    write_animation_files(animation, out)
    return animation


def write_animation_files(animation: Animation, out: Path) -> None:
    """They are made in a folder of their own beside `out` and then renamed: whatever happens, each file is whole."""
    try:
        scratch = Path(tempfile.mkdtemp(prefix=f".{out.stem}.", dir=out.parent))
        try:
            hand_over(_write_files(scratch, out, animation), scratch, out.parent)
        finally:
            shutil.rmtree(scratch)
    except OSError as error:
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
    except Tf.ErrorException as error:
        raise LayfigureError(f"cannot write '{out}': {reason(error)}") from error


def _write_files(scratch: Path, out: Path, animation: Animation) -> list[Path]:
    """The files to hand over, each after those that it needs."""
    packed = out.suffix == ".usdz"
    root = scratch / (f"{out.stem}.usdc" if packed else out.name)
    pictures = TextureFolder(scratch, out)
    textures = place_textures(animation.take.character, animation.take.meshes, out, pictures)
    write = _write_layers if animation.form.layout == "layered" else _write_single
    layers = write(root, animation, textures)
    form = animation.form
    if (form.up_axis, form.meters_per_unit) != (STAGE_UP_AXIS, METERS_PER_UNIT):
        for layer in layers:
            rewrite_in_units(layer, form.up_axis, form.meters_per_unit)
    if not packed:
        return [*pictures.files, *layers]
    for file in (*pictures.files, *layers):
        os.utime(file, (_PACKED_AT, _PACKED_AT))
    package = scratch / out.name
    if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(root)), str(package)):
        raise LayfigureError(f"cannot write '{out}': USD could not pack it")
    return [package]


def _write_single(root: Path, animation: Animation, textures: Textures) -> list[Path]:
    stage = Usd.Stage.CreateNew(str(root))
    set_stage_units(stage)
    set_stage_time(stage, animation.frames)
    write_character(stage, animation.take.character, animation.take.meshes, textures)
    write_animation(stage, animation)
    stage.GetRootLayer().Save()
    return [root]


def _write_layers(root: Path, animation: Animation, textures: Textures) -> list[Path]:
    take = animation.take
    character, layer = root.with_name(f"{root.stem}.character.usdc"), root.with_name(f"{root.stem}.anim.usdc")
    write_character_layer(str(character), take.character, take.meshes, textures)
    write_animation_layer(str(layer), animation)
    _write_root_layer(root, character.name, layer.name, take, animation.frames)
    return [character, layer, root]


def _write_root_layer(path: Path, character: str, animation: str, take: Take, frames: Frames) -> None:
    stage = Usd.Stage.CreateNew(str(path))
    set_stage_units(stage)
    set_stage_time(stage, frames)
    prim = stage.DefinePrim(character_prim_path(take.character))
    prim.GetReferences().AddReference(f"./{character}")
    stage.SetDefaultPrim(prim)
    Usd.ModelAPI(prim).SetKind(Kind.Tokens.component)
    stage.GetRootLayer().subLayerPaths = [f"./{animation}"]
    stage.GetRootLayer().Save()
