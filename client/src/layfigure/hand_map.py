"""The server's map from a pointer's hand to the world, kept along so that a session can name places in the world.

world = offset + scale * hand, as the server's WorkspaceMap with its base at the origin: neither a new scale nor the
clutch makes the pointer jump.
"""

from __future__ import annotations

import numpy as np

from layfigure.protocol import Floats


class HandMap:
    def __init__(self) -> None:
        self.clutched = False
        self.scale = 1.0
        self._offset: Floats = np.zeros(3)
        self._hand: Floats = np.zeros(3)  # where it was sent last
        self._held: Floats = np.zeros(3)  # in the world, when the clutch was pressed

    def sent(self, hand: Floats) -> None:
        self._hand = hand

    @property
    def unchanged(self) -> bool:
        """The pointer is exactly where its hand is."""
        return self.scale == 1.0 and not self._offset.any() and not self.clutched

    def to_world(self, hand: Floats) -> Floats:
        """Where the pointer is to be. While the clutch is held it stays."""
        world: Floats = self._held if self.clutched else self._offset + self.scale * hand
        return world

    def to_hand(self, world: Floats) -> Floats:
        """Where the hand has to be for its pointer to be there. Exactly there as long as nothing was set."""
        hand: Floats = (world - self._offset) / self.scale
        return hand

    def set_scale(self, scale: float) -> None:
        self._offset = self._offset + (self.scale - scale) * self._hand
        self.scale = scale

    def set_clutch(self, held: bool) -> None:
        if held and not self.clutched:
            self._held = self.to_world(self._hand)
        elif self.clutched and not held:
            self._offset = self._held - self.scale * self._hand
        self.clutched = held
