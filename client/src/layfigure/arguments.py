"""A command's arguments from Python values: any command of the server can be sent, also one that this client's code
does not know.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from layfigure.errors import UsageError
from layfigure.protocol import Argument

ArgumentValue = ArrayLike | None
"""A text, a number, a truth value (1 or 0), or an array of texts (sent with spaces between them) or of numbers (row by
row). None: the argument is left out."""


def arguments(command: str, values: Mapping[str, ArgumentValue]) -> tuple[Argument, ...]:
    """Raises UsageError, with the names of command and argument, for a value that cannot be sent."""
    return tuple(_argument(command, name, value) for name, value in values.items() if value is not None)


def _argument(command: str, name: str, value: ArgumentValue) -> Argument:
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.empty(0, np.object_)
    if array.dtype.kind == "U":
        return Argument(name, text=" ".join(array.ravel().tolist()))
    if array.dtype.kind in "biuf":
        return Argument(name, values=tuple(map(float, array.ravel())))
    raise UsageError(f"'{name}' of '{command}' is {value!r}: expected a text, a number, or an array of either")
