"""Vessel systems told apart by growing each from its root along the cheapest ways.

Portal and hepatic veins touch where they cross, so a mask of both is one piece with false branchings. Each piece of
its skeleton is to have one vessel that it comes from. All systems grow at the same time from their roots; of all ways
from a root to what is not grown yet the cheapest is taken, as Dijkstra's algorithm does (1959). A wrong step at a
crossing thus waits until the right vessel has come from the other side, and what grows backwards along the other
system pays for each step. A step costs

- the turn, (1 - cos angle) / 2, less the least turn into the same piece at the same site: a branch has no better stem
  than its own, but a vessel that crosses has itself on the other side;
- a part of the turn itself, since blood does not turn back;
- what Murray (1926) does not allow, log(sum of r³ of the branches / r³ of the stem) / 3: a vessel does not grow wider
  away from its root, nor can it feed more than its width;
- a gap, where the mask is broken: a constant and its length.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray
from glisson.preoperative.vessels.skeleton import FREE, Piece

_GAP_MM = 12.0
_GAP_COST = 0.3
_GAP_COST_PER_MM = 0.05
_TURN = 0.2
_WIDENING = 2.0
_ROOT_MM = 25.0
"""Ends within this distance of a root may come from it: hepatic veins meet outside the liver."""

ROOT = -1
ANYWHERE = -1


@dataclass(frozen=True)
class Grown:
    """How a piece was reached: its system, the piece that it comes from (or `ROOT`), and the end it starts at."""

    system: int
    parent: int
    start: int


@dataclass(frozen=True)
class _Step:
    """From the end `exit` of a piece over a site or a gap to the end `start` of another one."""

    parent: int
    child: int
    exit: int
    start: int
    cost: float


class _Growth:
    """The forest that grows, and the steps that are waiting."""

    def __init__(self, pieces: Sequence[Piece]) -> None:
        self._pieces = pieces
        self._into: dict[int, list[_Step]] = defaultdict(list)
        self._from: dict[int, list[_Step]] = defaultdict(list)
        for step in (*_steps_at_sites(pieces), *_steps_over_gaps(pieces)):
            self._into[step.child].append(step)
            self._from[step.parent].append(step)
        self._waiting: list[tuple[float, int, int, _Step]] = []
        self._offered = 0
        self._fed: dict[tuple[int, int], float] = defaultdict(float)
        self._total: dict[int, float] = {ROOT: 0.0}
        self.taken: dict[int, _Step] = {}
        self.system: dict[int, int] = {}

    def offer(self, system: int, step: _Step) -> None:
        """Let a step wait for its turn."""
        if step.child not in self.taken:
            self._offered += 1
            heappush(self._waiting, (self._cost(step), self._offered, system, step))

    def grow(self) -> None:
        """Take the cheapest way until none is left."""
        while self._waiting:
            cost, _, system, step = heappop(self._waiting)
            if step.child in self.taken:
                continue
            if self._cost(step) > cost + 1e-9:
                self.offer(system, step)  # a sister has come meanwhile
                continue
            self._total[step.child] = cost
            self._take(step)
            self.system[step.child] = system
            for following in self._from[step.child]:
                if self._leads_on(following):
                    self.offer(system, following)

    def _take(self, step: _Step) -> None:
        self.taken[step.child] = step
        self._feed(step, 1.0)

    def _feed(self, step: _Step, sign: float) -> None:
        self._fed[step.parent, step.exit] += sign * self._pieces[step.child].radius_mm ** 3

    def _leads_on(self, step: _Step) -> bool:
        """Whether a step leaves a piece where it does not begin; a gap may be left over from anywhere."""
        before = self.taken[step.parent]
        return step.exit == ANYWHERE or before.parent == ROOT or step.exit != before.start

    def _cost(self, step: _Step) -> float:
        so_far = self._total[step.parent] + step.cost
        if step.parent == ROOT:
            return so_far
        stem = self._pieces[step.parent].radius_mm ** 3
        wanted = self._fed[step.parent, step.exit] + self._pieces[step.child].radius_mm ** 3
        return so_far + _WIDENING * max(float(np.log(wanted / stem)) / 3.0, 0.0)

    def _children(self) -> dict[int, list[int]]:
        children: dict[int, list[int]] = defaultdict(list)
        for number, step in self.taken.items():
            children[step.parent].append(number)
        return children

    def result(self) -> dict[int, Grown]:
        """How each piece was reached, parents before children."""
        children = self._children()
        order = [below for number in children[ROOT] for below in _below(number, children)]
        return {n: Grown(self.system[n], self.taken[n].parent, self.taken[n].start) for n in order}


def split_pieces(pieces: Sequence[Piece], seeds_mm: Sequence[FloatArray]) -> dict[int, Grown]:
    """How each piece that can be reached was reached, parents before children.

    Args:
        pieces: of a skeleton.
        seeds_mm: the roots of each system (k, 3), LPS mm.
    """
    if not pieces:
        return {}
    growth = _Growth(pieces)
    for system, seeds in enumerate(seeds_mm):
        for seed in seeds:
            number = _piece_at(pieces, seed)
            growth.offer(system, _Step(ROOT, number, ANYWHERE, _nearer_end(pieces[number], seed), 0.0))
            for step in _steps_from_root(pieces, seed):
                growth.offer(system, step)
    growth.grow()
    return growth.result()


def _below(number: int, children: Mapping[int, list[int]]) -> dict[int, None]:
    """A piece and all that comes from it, parents before children."""
    found = {number: None}
    waiting = [number]
    while waiting:
        for child in children.get(waiting.pop(), []):
            found[child] = None
            waiting.append(child)
    return found


def _steps_at_sites(pieces: Sequence[Piece]) -> list[_Step]:
    at_site: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, piece in enumerate(pieces):
        for end, site in enumerate(piece.sites):
            if site != FREE:
                at_site[site].append((number, end))
    steps: list[_Step] = []
    for meeting in at_site.values():
        if len(meeting) < 2:
            continue
        inward = np.array([pieces[number].inward[end] for number, end in meeting])
        turns = 0.5 * (1.0 + inward @ inward.T)
        least = np.where(np.eye(len(meeting), dtype=bool), np.inf, turns).min(axis=0)
        costs = turns - least + _TURN * turns
        steps += [
            _Step(parent, child, leaves, start, float(costs[m, n]))
            for m, (parent, leaves) in enumerate(meeting)
            for n, (child, start) in enumerate(meeting)
            if parent != child
        ]
    return steps


def _piece_at(pieces: Sequence[Piece], point: FloatArray) -> int:
    """The piece whose wall is nearest to a point, or in which it lies deepest."""
    return int(np.argmin([np.linalg.norm(p.points_mm - point, axis=1).min() - p.radius_mm for p in pieces]))


def _nearer_end(piece: Piece, point: FloatArray) -> int:
    apart = [float(np.linalg.norm(piece.points_mm[n] - point)) for n in (0, -1)]
    return int(apart[1] < apart[0])


def _steps_from_root(pieces: Sequence[Piece], root: FloatArray) -> list[_Step]:
    steps = []
    for number, piece in enumerate(pieces):
        for end in (0, 1):
            away = piece.points_mm[-end] - root
            distance = float(np.linalg.norm(away))
            if piece.sites[end] == FREE and 0.0 < distance < _ROOT_MM:
                turn = 0.5 * (1.0 - float(away @ piece.inward[end]) / distance)
                steps.append(_Step(ROOT, number, ANYWHERE, end, turn + _gap_cost(distance)))
    return steps


def _gap_cost(distance_mm: float) -> float:
    return _GAP_COST + _GAP_COST_PER_MM * distance_mm


def _steps_over_gaps(pieces: Sequence[Piece]) -> list[_Step]:
    """Steps from anywhere to free ends near by."""
    points = np.concatenate([piece.points_mm for piece in pieces])
    owner = np.repeat(np.arange(len(pieces)), [len(piece.points_mm) for piece in pieces])
    tree = cKDTree(points)
    steps = []
    for number, piece in enumerate(pieces):
        for end in (0, 1):
            if piece.sites[end] != FREE:
                continue
            place = piece.points_mm[-end]
            near = np.array(tree.query_ball_point(place, _GAP_MM), dtype=np.int64)
            near = near[owner[near] != number]
            apart = np.linalg.norm(points[near] - place, axis=1)
            for other in np.unique(owner[near]).tolist():
                own = owner[near] == other
                point = points[near[own][apart[own].argmin()]]
                distance = max(float(apart[own].min()), 1e-6)
                turn = 0.5 * (1.0 - float((place - point) @ piece.inward[end]) / distance)
                steps.append(_Step(other, number, ANYWHERE, end, turn + _gap_cost(distance)))
    return steps
