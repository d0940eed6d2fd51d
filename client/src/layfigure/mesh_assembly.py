"""Puts the chunks of a character's meshes together, in whatever order and however often they come."""

from __future__ import annotations

from layfigure import codec
from layfigure.errors import ProtocolError
from layfigure.protocol import Character, Mesh, MeshChunk


class MeshAssembly:
    def __init__(self, character: Character) -> None:
        self._character = character
        self._total = 0  # unknown before the first chunk
        self._chunks: dict[int, bytes] = {}

    def add(self, chunk: MeshChunk) -> None:
        """Chunks of another character are left out. Raises ProtocolError if one contradicts the earlier ones."""
        if chunk.content_hash != self._character.content_hash:
            return
        if self._total not in (0, chunk.total):
            raise ProtocolError(f"mesh chunk {chunk.index} of {chunk.total}, expected a total of {self._total}")
        self._total = chunk.total
        self._chunks[chunk.index] = chunk.data

    @property
    def complete(self) -> bool:
        return self._total > 0 and len(self._chunks) == self._total

    @property
    def chunk_count(self) -> int:
        return len(self._chunks)

    def missing(self) -> list[int]:
        """Empty as long as no chunk has said how many there are."""
        return [index for index in range(self._total) if index not in self._chunks]

    def meshes(self) -> tuple[Mesh, ...]:
        joined = b"".join(self._chunks[index] for index in range(self._total))
        return codec.decode_meshes(joined, len(self._character.joints))
