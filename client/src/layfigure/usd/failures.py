"""What went wrong inside of USD, in one line."""

from __future__ import annotations

from pxr import Tf


def reason(error: Tf.ErrorException) -> str:
    """The first of what may be hundreds of errors: the others follow from it."""
    first = error.args[0] if error.args else error
    return str(getattr(first, "commentary", first)).strip().partition("\n")[0]
