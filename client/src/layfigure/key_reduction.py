"""The fewest keys between which no vertex of the skin is farther from its recorded place than a tolerance.

Frames are the nodes of a graph, and an edge leads from i to j > i if keys there, and none between, hold the tolerance
at every frame between: the fewest keys are a shortest path from the first frame to the last. Whether an edge holds is
not monotone, for a shorter interval may fail where a longer one is good; so a greedy choice of the farthest key is not
the best, and edges are looked for behind failures, up to LOOKAHEAD of them in a row.

Most edges are never needed. So the search is lazy (Dellin and Srinivasa 2016, "A Unifying Formalism for Shortest Path
Problems with Expensive Edge Evaluations"): an edge is believed in when it holds at a few frames; the edges of the
shortest path are then evaluated at every frame, those that fail are taken out, and the search is repeated until the
path holds. Only edges that do fail are ever taken out, so the path is the shortest of all that were looked for.

The cost is bounded: no edge is longer than MAX_SPAN frames, but for one where the doll rests: there the farthest edge
is known from the length of the skin's path, without evaluating any frame. How far the edges from a frame reach is
galloped to and bisected, so that there are some 2 log2(span) evaluations for each frame, plus LOOKAHEAD, of about
0.1 ms each for 50 joints and 13 000 vertices: 2 ms of CPU time for a frame at 240 fps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from layfigure.key_error import SkinDistance
from layfigure.skinning import Indices

MAX_SPAN = 256  # frames
LOOKAHEAD = 8  # frames; failures in a row after which no longer edge is looked for
_PROBES = ((1, 2), (1, 4), (3, 4))  # where an edge is first evaluated, as parts of it; the middle fails most often
_REST_SHARE = 0.49  # of the tolerance that the skin may move by in a rest: twice that, and roundings, are within it

Bools = NDArray[np.bool_]
Progress = Callable[[str], None]


def silent(_: str) -> None:
    """Tells nobody."""


def reduced_keys(distance: SkinDistance, tolerance_m: float, tell: Progress = silent) -> Indices:
    """The frames of the keys, rising. The first and the last frame are always among them, unless the doll rests from
    one to the other: then the first is the only one. `tell` is told now and then what is being done."""
    count = len(distance)
    ends = rest_ends(distance, tolerance_m)
    if ends[0] == count - 1:
        return np.zeros(1, np.intp)
    edges = _probed_edges(distance, ends, tolerance_m, tell)
    good: set[tuple[int, int]] = set()
    while True:
        path = _shortest_path(edges, ends)
        new = [edge for edge in zip(path[:-1].tolist(), path[1:].tolist(), strict=True) if edge not in good]
        new = [(first, last) for first, last in new if ends[first] < last]
        failed = _failed(distance, new, tolerance_m)
        if not failed:
            return path
        tell(f"keys: {len(path)}, of which {len(failed)} are too far apart")
        good.update(set(new) - failed)
        for first, last in failed:
            edges[first, last - first] = False


def rest_ends(distance: SkinDistance, tolerance_m: float) -> Indices:
    """(F) up to which frame the skin stays so close to where it is in each frame that keys at both hold in between."""
    lengths = distance.path_lengths()
    return np.searchsorted(lengths, lengths + _REST_SHARE * tolerance_m, side="right") - 1


def _probed_edges(distance: SkinDistance, rest_ends: Indices, tolerance_m: float, tell: Progress) -> Bools:
    """(F, MAX_SPAN + 1): whether the edge from a frame, so many frames long, may hold.

    The reach of each frame is galloped to and then bisected; what is shorter is believed in, what is longer looked at.
    """
    count = len(distance)
    edges = np.zeros((count, min(MAX_SPAN, count - 1) + 1), np.bool_)
    longest = np.minimum(edges.shape[1] - 1, count - 1 - np.arange(count))

    def holds(first: Indices, spans: Indices) -> Bools:
        return _holds_at_probes(distance, first, spans, rest_ends, tolerance_m)

    reach, fails = np.minimum(1, longest), longest + 1  # the first holds always, and nothing is known in between
    asked = np.flatnonzero(reach < longest)
    while len(asked):
        tell("keys: how far each frame reaches")
        bound = fails[asked]
        doubled = np.minimum(2 * reach[asked], longest[asked])
        spans = np.where(bound > longest[asked], doubled, (reach[asked] + bound) // 2)
        good = holds(asked, spans)
        reach[asked[good]], fails[asked[~good]] = spans[good], spans[~good]
        asked = asked[fails[asked] - reach[asked] > 1]
    edges |= np.arange(edges.shape[1]) <= reach[:, None]
    edges[:, 0] = False
    _look_ahead(edges, reach, longest, holds, tell)
    return edges


def _look_ahead(
    edges: Bools, reach: Indices, longest: Indices, holds: Callable[[Indices, Indices], Bools], tell: Progress
) -> None:
    """Adds the edges behind those that fail just past each frame's reach."""
    spans, failures = reach + 2, np.ones(len(edges), np.intp)
    asked = np.flatnonzero(spans <= longest)
    while len(asked):
        tell("keys: what is behind")
        good = holds(asked, spans[asked])
        edges[asked, spans[asked]] = good
        failures[asked] = np.where(good, 0, failures[asked] + 1)
        spans[asked] += 1
        asked = asked[(failures[asked] < LOOKAHEAD) & (spans[asked] <= longest[asked])]


def _holds_at_probes(
    distance: SkinDistance, first: Indices, spans: Indices, rest_ends: Indices, tolerance_m: float
) -> Bools:
    holds = np.ones(len(first), np.bool_)
    for part, whole in _PROBES:
        asked = np.flatnonzero(holds & (rest_ends[first] < first + spans) & (spans > 1))
        starts, ends = first[asked], first[asked] + spans[asked]
        holds[asked] = ~distance.exceeds(
            starts, ends, starts + np.maximum(1, spans[asked] * part // whole), tolerance_m
        )
    return holds


def _shortest_path(edges: Bools, rest_ends: Indices) -> Indices:
    count = len(edges)
    lengths = np.full(count, count + 1)
    before = np.zeros(count, np.intp)
    lengths[0] = 1
    for first in range(count - 1):
        targets = first + np.append(np.flatnonzero(edges[first]), rest_ends[first] - first)
        nearer = targets[lengths[targets] > lengths[first] + 1]
        lengths[nearer] = lengths[first] + 1
        before[nearer] = first
    path = [count - 1]
    while path[-1] > 0:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1])


def _failed(distance: SkinDistance, edges: list[tuple[int, int]], tolerance_m: float) -> set[tuple[int, int]]:
    """Those of the edges that do not hold at every frame."""
    between = [np.arange(first + 1, last) for first, last in edges]
    repeats = [len(frames) for frames in between]
    index = np.repeat(np.arange(len(edges)), repeats)
    pairs = np.array(edges, np.intp).reshape(-1, 2)[index]
    frames = np.concatenate([np.zeros(0, np.intp), *between])
    exceeds = distance.exceeds(pairs[:, 0], pairs[:, 1], frames, tolerance_m)
    return {edges[each] for each in np.unique(index[exceeds])}
