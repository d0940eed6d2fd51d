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

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from layfigure.key_error import SkinDistance
from layfigure.protocol import Floats
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
    return KeySearch(distance, tolerance_m, tell).keys(np.full(len(distance), tolerance_m))


def rest_ends(distance: SkinDistance, tolerance_m: float) -> Indices:
    """(F) up to which frame the skin stays so close to where it is in each frame that keys at both hold in between."""
    lengths = distance.path_lengths()
    return np.searchsorted(lengths, lengths + _REST_SHARE * tolerance_m, side="right") - 1


class KeySearch:
    """Remembers what it has found out, for a search with a lower tolerance: what fails is then not asked again, and
    what holds only where the tolerance has changed.

    Rests are those of `tolerance_m`, whatever the tolerances of single frames.
    """

    def __init__(self, distance: SkinDistance, tolerance_m: float, tell: Progress = silent) -> None:
        self.rest_ends = rest_ends(distance, tolerance_m)
        self._distance = distance
        self._tell = tell
        count = len(distance)
        spans = min(MAX_SPAN, count - 1)
        self._longest = np.minimum(spans, count - 1 - np.arange(count))
        # (F, spans + 1): whether the edge from a frame, so many frames long, may hold
        self._edges = np.arange(spans + 1) <= self._longest[:, None]
        self._edges[:, 0] = False
        self._good: set[tuple[int, int]] = set()
        self._tolerances = np.full(count, np.inf)

    def keys(self, tolerances: Floats) -> Indices:
        """As reduced_keys(), with a tolerance of each frame (F) [m], nowhere greater than in the last call."""
        count = len(self._distance)
        if self.rest_ends[0] == count - 1:
            return np.zeros(1, np.intp)
        self._tighten(tolerances)
        while True:
            path = _shortest_path(self._edges, self.rest_ends)
            new = [edge for edge in itertools.pairwise(path.tolist()) if edge not in self._good]
            new = [(first, last) for first, last in new if self.rest_ends[first] < last]
            failed = self._failed(new)
            if not failed:
                return path
            self._tell(f"keys: {len(path)}, of which {len(failed)} are too far apart")
            self._good.update(set(new) - failed)
            for first, last in failed:
                self._edges[first, last - first] = False

    def _tighten(self, tolerances: Floats) -> None:
        changed = np.flatnonzero(tolerances != self._tolerances)
        self._tolerances = tolerances
        nearest = np.append(changed, len(self._edges))[np.searchsorted(changed, np.arange(len(self._edges)), "right")]
        self._good = {(first, last) for first, last in self._good if nearest[first] >= last}
        farthest = self._edges.shape[1] - 1 - np.argmax(self._edges[:, ::-1], axis=1)
        starts = np.flatnonzero(self._edges.any(axis=1) & (nearest < np.arange(len(self._edges)) + farthest))
        self._edges[starts] &= self._probed(starts)

    def _probed(self, starts: Indices) -> Bools:
        """(S, spans + 1) which of the edges from these frames may hold.

        The reach of each frame is galloped to and then bisected; what is shorter is believed in, what is longer looked
        at.
        """
        longest = self._longest[starts]
        reach, fails = np.minimum(1, longest), longest + 1  # the first holds always, and nothing is known in between
        asked = np.flatnonzero(reach < longest)
        while len(asked):
            self._tell("keys: how far each frame reaches")
            bound = fails[asked]
            doubled = np.minimum(2 * reach[asked], longest[asked])
            spans = np.where(bound > longest[asked], doubled, (reach[asked] + bound) // 2)
            good = self._holds_at_probes(starts[asked], spans)
            reach[asked[good]], fails[asked[~good]] = spans[good], spans[~good]
            asked = asked[fails[asked] - reach[asked] > 1]
        edges = np.arange(self._edges.shape[1]) <= reach[:, None]
        self._look_ahead(edges, starts, reach)
        return edges

    def _look_ahead(self, edges: Bools, starts: Indices, reach: Indices) -> None:
        """Adds the edges behind those that fail just past each frame's reach."""
        longest = self._longest[starts]
        spans, failures = reach + 2, np.ones(len(edges), np.intp)
        asked = np.flatnonzero(spans <= longest)
        while len(asked):
            self._tell("keys: what is behind")
            good = self._holds_at_probes(starts[asked], spans[asked])
            edges[asked, spans[asked]] = good
            failures[asked] = np.where(good, 0, failures[asked] + 1)
            spans[asked] += 1
            asked = asked[(failures[asked] < LOOKAHEAD) & (spans[asked] <= longest[asked])]

    def _holds_at_probes(self, first: Indices, spans: Indices) -> Bools:
        holds = np.ones(len(first), np.bool_)
        for part, whole in _PROBES:
            asked = np.flatnonzero(holds & (self.rest_ends[first] < first + spans) & (spans > 1))
            starts, ends = first[asked], first[asked] + spans[asked]
            between = starts + np.maximum(1, spans[asked] * part // whole)
            holds[asked] = ~self._distance.exceeds(starts, ends, between, self._tolerances[between])
        return holds

    def _failed(self, edges: list[tuple[int, int]]) -> set[tuple[int, int]]:
        """Those of the edges that do not hold at every frame."""
        between = [np.arange(first + 1, last) for first, last in edges]
        repeats = [len(frames) for frames in between]
        index = np.repeat(np.arange(len(edges)), repeats)
        pairs = np.array(edges, np.intp).reshape(-1, 2)[index]
        frames = np.concatenate([np.zeros(0, np.intp), *between])
        exceeds = self._distance.exceeds(pairs[:, 0], pairs[:, 1], frames, self._tolerances[frames])
        return {edges[each] for each in np.unique(index[exceeds])}


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
