"""Where a take's textures are: files that the character's own names, and pictures that are written beside the take.

    OUT.textures/NAME.png   pictures that the character's file holds; in a package also those from files

The names of files come from a stranger's character. They are only looked for, and named in the take; for a package they
are read, and put into it, if they are pictures in the character's folder or below.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from layfigure.protocol import Character, Image, Material, Mesh
from layfigure.usd.names import legal_name
from layfigure.usd.pictures import as_png_or_jpeg

Textures = dict[Material, str]  # the asset path of each material's base colour texture, if it has one

_ELSEWHERE = re.compile(r"/|[A-Za-z]:/|[a-z]+://")  # what an absolute path or a URL begins with

_MAX_BYTES = 256 << 20  # of a file that is packed

_logger = logging.getLogger(__name__)


def texture_folder(out: Path) -> Path:
    """Where a take's pictures are, if it has any."""
    return out.with_name(f"{out.stem}.textures")


class TextureFolder:
    """The folder OUT.textures of a take, as it is made in `scratch`."""

    def __init__(self, scratch: Path, out: Path) -> None:
        self._scratch = scratch
        self._name = texture_folder(out).name
        self.files: list[Path] = []

    def add(self, name: str, data: bytes) -> str | None:
        """Writes a picture under a name that begins like `name`; returns its asset path, from the folder that the take
        is in. None if it is no picture."""
        picture = as_png_or_jpeg(data)
        if picture is None:
            return None
        kind, data = picture
        path = self._free_path(legal_name(PurePosixPath(name).stem, "texture"), kind)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
        self.files.append(path)
        return f"./{self._name}/{path.name}"

    def _free_path(self, stem: str, suffix: str) -> Path:
        candidates = [f"{stem}.{suffix}", *(f"{stem}_{number}.{suffix}" for number in range(1, len(self.files) + 1))]
        taken = {path.name.lower() for path in self.files}  # there are folders that do not tell A from a
        free = next(name for name in candidates if name.lower() not in taken)
        return self._scratch / self._name / free


def place_textures(character: Character, meshes: Iterable[Mesh], out: Path, folder: TextureFolder) -> Textures:
    """Of the materials of a take that is written to `out`; pictures go to `folder`."""
    packed = out.suffix == ".usdz"
    textures: Textures = {}
    of_images: dict[Image, str | None] = {}
    for material in materials_of(meshes):
        path: str | None = None
        if material.image is not None:
            if material.image not in of_images:
                of_images[material.image] = _add_image(material, material.image, folder)
            path = of_images[material.image]
        elif material.texture:
            path = _pack(material, character, folder) if packed else texture_path(material, character, out)
        if path is not None:
            textures[material] = path
    return textures


def named_textures(character: Character, meshes: Iterable[Mesh], out: Path) -> Textures:
    """Those alone that are files already."""
    return {
        material: texture_path(material, character, out)
        for material in materials_of(meshes)
        if material.image is None and material.texture
    }


def materials_of(meshes: Iterable[Mesh]) -> Iterator[Material]:
    """Each once."""
    yield from dict.fromkeys(mesh.material for mesh in meshes if mesh.material is not None)


def asset_path_from(path: str, out: Path) -> str:
    """The asset path, in a file `out`, of what is at `path`: relative, if it may be."""
    if not path.startswith("/"):
        return path
    return _from_here(PurePosixPath(os.path.relpath(path, out.parent.resolve())).as_posix())


def hand_over(files: Iterable[Path], scratch: Path, folder: Path) -> None:
    """Moves files that are whole from `scratch` to the same places in `folder`, one after the other."""
    for path in files:
        target = folder / path.relative_to(scratch)
        target.parent.mkdir(exist_ok=True)
        path.chmod(0o644)
        path.replace(target)


def texture_path(material: Material, character: Character, out: Path) -> str:
    """The asset path, in a file `out`, of a texture that is a file."""
    found = _find(material, character)
    if found is None:
        return material.texture if _ELSEWHERE.match(material.texture) else _from_here(material.texture)
    if _ELSEWHERE.match(material.texture) and found == Path(material.texture):
        return material.texture
    return asset_path_from(str(found), out)


def _from_here(path: str) -> str:
    """USD takes other relative paths as ones to be searched for."""
    return path if path.startswith("../") else f"./{path}"


def _find(material: Material, character: Character) -> Path | None:
    """The texture as its path says, or else, as a path of another machine would be, beside the character's file; None
    if it is not known where that is."""
    if not character.source_folder:
        return None
    folder = Path(character.source_folder)
    named = folder / material.texture
    beside = folder / PurePosixPath(material.texture).name
    if named.is_file() or not beside.is_file():
        return named if not re.match("[A-Za-z]:/|[a-z]+://", material.texture) else None
    return beside


def _add_image(material: Material, image: Image, folder: TextureFolder) -> str | None:
    path = folder.add(image.name or material.name, image.data)
    if path is None:
        _logger.warning(
            "the texture of material '%s' is left out: its %s in the character's file is no picture that can be read",
            material.name,
            image.format or "picture",
        )
    return path


def _pack(material: Material, character: Character, folder: TextureFolder) -> str | None:
    found = _find(material, character)
    try:
        path = folder.add(found.name, found.read_bytes()) if found and _may_be_read(found, character) else None
    except OSError:
        path = None
    if path is None:
        _logger.warning(
            "the texture of material '%s' is left out of the package: '%s' is no picture in the folder of '%s'",
            material.name,
            material.texture,
            character.source_file,
        )
    return path


def _may_be_read(path: Path, character: Character) -> bool:
    whole = path.resolve()  # a link may lead anywhere
    below = whole.is_relative_to(Path(character.source_folder).resolve())
    return below and whole.is_file() and whole.stat().st_size <= _MAX_BYTES
