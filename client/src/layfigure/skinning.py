"""Linear blend skinning of a character's meshes, of many poses at once, and their boxes.

    v = sum_k w_k X_WJ(k) X_WJ_bind(k)^-1 v_bind

A motion X_WJ X_WJ_bind^-1 is linear in its twelve numbers, so a vertex is the product of the motions' rows with numbers
that never change, the weights times (v_bind, 1). The vertices are kept in blocks, one for each joint, of those whose
greatest weight is that joint's: a block is moved by few joints, and one matrix product skins it in any number of poses.

Leading axis F: frames. All is in the world [m], double precision.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation
from layfigure.protocol import Character, Floats, Mesh

Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Block:
    vertices: Indices  # (V) among those of all meshes, in their order
    joints: Indices  # (K) that move them
    coefficients: Floats  # (4 K, V): the weights times (v_bind, 1)


@dataclass(frozen=True, eq=False)
class Bounds:
    """Where the vertices of a block are that one of its joints moves, in the bind pose; B pairs of block and joint.

    A skinned vertex is a mean of such points, each moved by its joint.
    """

    starts: Indices  # of each block's pairs
    joints: Indices  # (B)
    centres: Floats  # (B, 3) of the vertices' boxes
    half_sizes: Floats  # (B, 3)
    radii: Floats  # (B) of the spheres about the centres
    reaches: Floats  # (B) of the spheres about the joints


class Skin:
    def __init__(self, character: Character, meshes: Sequence[Mesh]) -> None:
        joints = character.joints
        self._bind_inverses = rotation.conjugate(np.array([joint.bind_rotation for joint in joints]))
        self._bind_positions = np.array([joint.bind_translation for joint in joints])
        points, weights = _joined(meshes, len(joints))
        self.vertex_count = len(points)
        self.blocks = _blocks(points, weights)
        self.bounds = _bounds(points, weights, self.blocks, self._bind_positions)

    def motions(self, world_rotations: Floats, positions: Floats) -> Floats:
        """(F, 3, J, 4), the rows of each joint's 3x4 matrix from its bind pose, of world poses (F, J, 4), (F, J, 3)."""
        turns = rotation.multiply(world_rotations, self._bind_inverses)
        motions = np.empty((len(positions), 3, positions.shape[1], 4))
        motions[..., :3] = np.swapaxes(rotation.to_matrix(turns), 1, 2)
        carried = np.einsum("fijk,jk->fij", motions[..., :3], self._bind_positions)
        motions[..., 3] = np.swapaxes(positions, 1, 2) - carried
        return motions

    def skin_block(self, block: Block, motions: Floats) -> Floats:
        """(F, 3, V) of motions, or of differences of motions."""
        rows = motions[:, :, block.joints].reshape(-1, len(block.coefficients))
        return np.asarray((rows @ block.coefficients).reshape(len(motions), 3, -1), np.float64)

    def skin(self, motions: Floats) -> Floats:
        """(F, V, 3), the vertices of all meshes, in their order."""
        skinned = np.zeros((len(motions), self.vertex_count, 3))
        for block in self.blocks:
            skinned[:, block.vertices] = np.swapaxes(self.skin_block(block, motions), 1, 2)
        return skinned

    def of_blocks(self, of_pairs: Floats) -> Floats:
        """(F, blocks): of upper bounds (F, B) for the pairs of block and joint those for the blocks."""
        return np.asarray(np.maximum.reduceat(of_pairs, self.bounds.starts, axis=1), np.float64)

    def boxes(self, motions: Floats) -> Floats:
        """(F, 2, 3) least and greatest corner of the skinned vertices. Few blocks can hold the outermost one."""
        boxes = np.empty((len(motions), 2, 3))
        bounds = self.bounds
        for axis in range(3):
            rows = motions[:, axis]
            of_pairs = rows[:, bounds.joints]
            middles = np.einsum("fbk,bk->fb", of_pairs[..., :3], bounds.centres) + of_pairs[..., 3]
            halves = np.einsum("fbk,bk->fb", np.abs(of_pairs[..., :3]), bounds.half_sizes)
            for end, sign in ((0, -1.0), (1, 1.0)):
                outermost = self._outermost(rows, sign)
                boxes[:, end, axis] = sign * largest(self.of_blocks(sign * middles + halves), outermost)
        return boxes

    def _outermost(self, rows: Floats, sign: float) -> Callable[[int, Indices], Floats]:
        def evaluate(index: int, frames: Indices) -> Floats:
            block = self.blocks[index]
            places = rows[frames[:, None], block.joints].reshape(len(frames), -1) @ block.coefficients
            return np.asarray(places.max(axis=1) if sign > 0.0 else -places.min(axis=1), np.float64)

        return evaluate


def largest(
    bounds: Floats,
    evaluate: Callable[[int, Indices], Floats],
    floor: float | Floats = -np.inf,
    ceiling: float | Floats = np.inf,
) -> Floats:
    """(F) the greatest of each row's values, of which only upper bounds (F, N) are known at first.

    evaluate(column, rows) tells values; it is asked for the most promising first, and for no more than it takes. Values
    up to `floor` count as `floor`; of a row that is found to exceed `ceiling`, any value above that is told. Both
    may be (F).
    """
    bounds = bounds.copy()
    values = np.full(len(bounds), floor)
    ceilings = np.broadcast_to(ceiling, len(bounds))
    rows = np.arange(len(bounds))
    while len(rows):
        columns = bounds[rows].argmax(axis=1)
        undecided = (bounds[rows, columns] > values[rows]) & (values[rows] <= ceilings[rows])
        rows, columns = rows[undecided], columns[undecided]
        for column in np.unique(columns):
            asked = rows[columns == column]
            values[asked] = np.maximum(values[asked], evaluate(int(column), asked))
        bounds[rows, columns] = -np.inf
    return values


def _joined(meshes: Sequence[Mesh], joint_count: int) -> tuple[Floats, Floats]:
    """Points (V, 3) and weights (V, J) of all meshes."""
    points = np.concatenate([np.zeros((0, 3)), *(mesh.points.astype(np.float64) for mesh in meshes)])
    weights = np.zeros((len(points), joint_count))
    start = 0
    for mesh in meshes:
        rows = np.arange(start, start + len(mesh.points))
        for k in range(mesh.joint_indices.shape[1]):  # one after the other: a joint may be named twice
            weights[rows, mesh.joint_indices[:, k]] += mesh.joint_weights[:, k]
        start += len(mesh.points)
    return points, weights


def _bounds(points: Floats, weights: Floats, blocks: Sequence[Block], positions: Floats) -> Bounds:
    counts = [len(block.joints) for block in blocks]
    joints = np.concatenate([np.zeros(0, np.intp), *(block.joints for block in blocks)])
    moved = [points[block.vertices[weights[block.vertices, joint] > 0.0]] for block in blocks for joint in block.joints]
    low = np.array([each.min(axis=0) for each in moved]).reshape(-1, 3)
    high = np.array([each.max(axis=0) for each in moved]).reshape(-1, 3)
    centres = 0.5 * (low + high)

    def farthest(origins: Floats) -> Floats:
        return np.array([np.linalg.norm(each - o, axis=1).max() for each, o in zip(moved, origins, strict=True)])

    return Bounds(
        starts=np.cumsum([0, *counts[:-1]]),
        joints=joints,
        centres=centres,
        half_sizes=0.5 * (high - low),
        radii=farthest(centres),
        reaches=farthest(positions[joints]),
    )


def _blocks(points: Floats, weights: Floats) -> tuple[Block, ...]:
    first = weights.argmax(axis=1) if len(points) else np.zeros(0, np.intp)
    bound = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    blocks = []
    for joint in np.unique(first):
        vertices = np.flatnonzero(first == joint)
        joints = np.flatnonzero(weights[vertices].any(axis=0))
        if len(joints) == 0:
            continue  # without any weight: UsdSkel leaves such vertices at the origin
        parts = weights[vertices][:, joints, None] * bound[vertices, None]
        blocks.append(Block(vertices, joints, np.ascontiguousarray(parts.reshape(len(vertices), -1).T)))
    return tuple(blocks)
