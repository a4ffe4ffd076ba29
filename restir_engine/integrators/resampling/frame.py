"""A frame in progress: what every pixel keeps from one kernel to the next, and what the next frame finds of it."""

from __future__ import annotations

import copy

import numpy as np

from ...kernels.core.memory import address, record_at
from ...kernels.core.records import CAMERA, CLOSURE, PATH, SHADING_POINT
from ...scene.record_owner import RecordOwner

HIT = np.dtype(  # of a ray, as kernels.geometry.intersect tells it
    [("instance", np.int32), ("primitive", np.int32), ("t", np.float32), ("u", np.float32), ("v", np.float32)]
)
UNTRACED = -2  # in place of its instance

EDGES = "left", "bottom", "right", "top"  # of the film's pixels, those that are here; the last two are outside
FRAME = np.dtype(
    [
        ("width", np.int64),
        ("height", np.int64),
        *((edge, np.int64) for edge in EDGES),
        ("channels", np.int64),  # of the film
        # Addresses of one item a pixel, rows bottom to top:
        ("points", np.int64),  # SHADING_POINT: the vertex to be lit, with its closures; instance -1: there is none
        ("paths", np.int64),  # PATH as it arrived at that vertex
        ("reservoirs", np.int64),  # RESERVOIR: of the candidates, then of each reuse
        ("reused", np.int64),  # RESERVOIR: what a pass of reuse writes; it takes the place of the others afterwards
        ("pixels", np.int64),  # float32 [channels]: what this frame adds to the film
        ("hits", np.int64),  # HIT of the ray by which the path goes on
        # float32 [9] by class of lobes: f of the sample in the reservoir as p̂ has it; after the last of candidates and
        # reuse the direct light. Each channel is that of its own reservoir, where there is one for each.
        ("light", np.int64),
        # float32 [9] likewise, the indirect part of what lights, which is not in `light`; 0: there is none
        ("indirect", np.int64),
        # float32 [groups, 3]: what lights in the end, by light group; 0: there are none
        ("light_by_group", np.int64),
        ("light_groups", np.int64),  # LIGHT_GROUPS, see FILM
        ("mean_visibilities", np.int64),  # float32 [4]: kernels.lights.mean_visibility
        ("control_variates", np.int64),  # float32 [3]: LIGHT_SAMPLE.control_variate of the candidates, times the guess
        ("domains", np.int64),  # what the technique keeps of a pixel's domain, laid out as it likes; 0: nothing
        ("radii", np.int64),  # float32: how far spatial neighbours may be, pixels; 0: REUSE.radius for all
    ]
)

hit_at = record_at(HIT)
frame_at = record_at(FRAME)


_BY_PIXEL = (
    "points", "paths", "pixels", "hits", "light", "indirect", "light_by_group", "mean_visibilities",
    "control_variates",
)  # fmt: skip


class Frame(RecordOwner):
    """Owner of what FRAME points to; a sequence has one `mean_visibilities`, float32 (height, width, 4).

    reservoir: dtype of the technique's reservoirs, of which there are so many layers; indirect: whether its samples may
    be indirect light. light_groups: LIGHT_GROUPS (1,) that have passes; None: there are none.
    """

    def __init__(
        self,
        width: int,
        height: int,
        channels: int,
        mean_visibilities: np.ndarray,
        reservoir: np.dtype,
        layers: int = 1,
        indirect: bool = False,
        light_groups: np.ndarray | None = None,
    ) -> None:
        self.points = np.zeros((height, width), SHADING_POINT)
        self.points["instance"] = -1
        self.paths = np.zeros((height, width), PATH)
        self._reservoirs = [np.zeros((layers, height, width), reservoir) for _ in range(2)]
        self.pixels = np.zeros((height, width, channels), np.float32)
        self.hits = np.zeros((height, width), HIT)
        self.light = np.zeros((height, width, 9), np.float32)
        self.indirect = np.zeros((height, width, 9) if indirect else 0, np.float32)
        groups = 0 if light_groups is None else int(light_groups[0]["count"])
        self.light_by_group = np.zeros((height, width, groups, 3), np.float32)
        self.mean_visibilities = mean_visibilities
        self.control_variates = np.zeros((height, width, 3), np.float32)
        self.camera = np.zeros(1, CAMERA)
        self._pools: dict[tuple[int, int], np.ndarray] = {}
        self._record = np.zeros(1, FRAME)
        record = self._record[0]
        record["width"], record["height"], record["channels"] = width, height, channels
        record["light_groups"] = address(light_groups) if groups else 0
        self.companions: dict[str, Frame] = {}  # of other techniques at the same points
        self._x = self._y = 0
        self.place((0, 0, width, height))

    def place(self, tile: tuple[int, int, int, int]) -> None:
        """Let the lower left items stand for a tile of the film: kernels go by its coordinates."""
        self._x, self._y = tile[:2]
        for name, value in zip(EDGES, tile, strict=True):
            self._record[0][name] = value
        for name in _BY_PIXEL:
            self._record[0][name] = self._origin(getattr(self, name))
        self.use_reservoirs(0)

    def accompany(self, name: str, reservoir: np.dtype, domain: np.dtype, radii: bool = False) -> None:
        """Make a companion: it shares all but reservoirs, light, and what its technique keeps of each pixel.

        radii: whether how far neighbours may be is a part of that.
        """
        other = copy.copy(self)
        shape = self.points.shape
        other._reservoirs = [np.zeros((1, *shape), reservoir) for _ in range(2)]
        other.light = np.zeros((*shape, 9), np.float32)
        other.light_by_group = np.zeros_like(self.light_by_group)
        other.domains = np.zeros(shape, domain)
        other.radii = np.zeros(shape if radii else 0, np.float32)
        other.companions = {}
        other._record = self._record.copy()
        for field in ("light", "light_by_group", "domains", "radii"):
            array = getattr(other, field)
            other._record[0][field] = address(array) if array.size else 0
        other.use_reservoirs(0)
        self.companions[name] = other

    def _origin(self, array: np.ndarray, axis: int = 1) -> int:
        """The address at which the item of the film's first pixel would be; axis: that of the columns."""
        if not array.size:
            return 0
        return address(array) - array.strides[axis] * (self._y * self.points.shape[1] + self._x)

    @property
    def reservoirs(self) -> np.ndarray:
        """RESERVOIR (layers, height, width): those that the next pass reads."""
        return self._reservoirs[0]

    def use_reservoirs(self, turn: int = 1) -> None:
        """Point the record at the reservoirs; with turn 1, those that were written take the place of those read."""
        if turn:
            self._reservoirs.reverse()
        self._record[0]["reservoirs"], self._record[0]["reused"] = (
            self._origin(array, 2) for array in self._reservoirs
        )

    def pool(self, tile: tuple[int, int, int, int], closures: int) -> np.ndarray:
        """Room for the closures of a tile's pixels, of at least that many."""
        pool = self._pools.get(tile[:2])
        if pool is None or len(pool) < closures:
            area = (tile[2] - tile[0]) * (tile[3] - tile[1])
            pool = self._pools[tile[:2]] = np.empty(max(closures + closures // 8, area), CLOSURE)
        return pool

    @property
    def bytes(self) -> int:
        """Memory that the frame takes."""
        arrays = [self.points, self.paths, self.pixels, self.hits, self.light, self.indirect]
        arrays += [self.mean_visibilities, self.control_variates, self.light_by_group]
        for own in self.companions.values():
            arrays += [own.light, own.light_by_group, own.domains, own.radii, *own._reservoirs]
        return sum(array.nbytes for array in [*arrays, *self._reservoirs, *self._pools.values()])
