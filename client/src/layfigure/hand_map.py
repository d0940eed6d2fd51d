"""The server's map from a pointer's hand to the world, kept along so that a session can say where in the world it means.

world = offset + scale * hand, as the server's WorkspaceMap with its base at the origin: neither a new scale nor the
clutch makes the pointer jump.
"""

from __future__ import annotations

import numpy as np

from layfigure.protocol import Floats


class HandMap:
    def __init__(self) -> None:
        self.clutched = False
        self._scale = 1.0
        self._offset: Floats = np.zeros(3)
        self._hand: Floats = np.zeros(3)  # where it was sent last
        self._held: Floats = np.zeros(3)  # in the world, when the clutch was pressed

    def sent(self, hand: Floats) -> None:
        self._hand = hand

    def to_hand(self, world: Floats) -> Floats:
        """Where the hand has to be for its pointer to be there. Exactly there as long as nothing was set."""
        hand: Floats = (world - self._offset) / self._scale
        return hand

    def set_scale(self, scale: float) -> None:
        self._offset = self._offset + (self._scale - scale) * self._hand
        self._scale = scale

    def set_clutch(self, held: bool) -> None:
        if held and not self.clutched:
            self._held = self._offset + self._scale * self._hand
        elif self.clutched and not held:
            self._offset = self._held - self._scale * self._hand
        self.clutched = held
