"""Picture files that USD and glTF can hold."""

from __future__ import annotations

import io

PNG, JPEG = "png", "jpg"
_MAGIC = {PNG: b"\x89PNG\r\n\x1a\n", JPEG: b"\xff\xd8\xff"}
MIME_TYPES = {PNG: "image/png", JPEG: "image/jpeg"}
_WITH_ALPHA = ("RGBA", "LA", "PA", "RGBa", "La")


def picture_type(data: bytes) -> str | None:
    """PNG or JPEG, by the first bytes; None: another format, or no picture."""
    return next((name for name, magic in _MAGIC.items() if data.startswith(magic)), None)


def as_png_or_jpeg(data: bytes) -> tuple[str, bytes] | None:
    """The picture's type and bytes: as they are if that is a PNG or JPEG, else as a PNG. None: it is no picture, or
    larger than Pillow trusts."""
    from PIL import Image as Pillow  # here, as takes without pictures are written where there is no Pillow: in Blender

    try:
        with Pillow.open(io.BytesIO(data)) as picture:
            kind = picture_type(data)
            if kind is not None:
                return kind, data  # Pillow has read its header
            whole = picture.convert("RGBA" if picture.mode in _WITH_ALPHA or "transparency" in picture.info else "RGB")
    except (OSError, ValueError, SyntaxError, Pillow.DecompressionBombError):
        return None
    png = io.BytesIO()
    whole.save(png, "PNG")
    return PNG, png.getvalue()
