"""Particle hair → `Strands`.

Blender hands its points out one at a time, 1 to 2.5 µs each. So hair is read once and kept: with what it grows from
(emitter, settings) and a sample of its strands the same, it is taken for the same in another frame or view layer. What
is simulated is read for each frame.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from itertools import chain

import numpy as np

from ..kernels.core.digest import digest
from ..scene.strands import Strands

# Strands that are looked at for whether others have to be read again: of parents, and of children.
_PARENTS, _CHILDREN = 2048, 256


def hair_systems(item, is_render: bool) -> list[tuple]:
    """The (modifier, particle system) pairs of an evaluated object that are drawn as strands."""
    shown = "show_render" if is_render else "show_viewport"
    return [
        (modifier, modifier.particle_system)
        for modifier in item.modifiers
        if modifier.type == "PARTICLE_SYSTEM" and getattr(modifier, shown) and _is_hair(modifier.particle_system)
    ]


def _is_hair(system) -> bool:
    return system.settings.type == "HAIR" and system.settings.render_type == "PATH" and len(system.particles) > 0


class Hair:
    """The strands of an evaluated object's particle systems, one system behind another."""

    def __init__(self, owner, is_render: bool) -> None:
        self._owner = owner
        self._systems = hair_systems(owner, is_render)
        self._numbers = [_numbers(system, is_render) for _, system in self._systems]
        self._steps = [_steps(system.settings, is_render) for _, system in self._systems]
        self._to_object = np.array(owner.matrix_world.inverted_safe())

    def __len__(self) -> int:
        return sum(map(len, self._numbers))

    def key(self, time: float) -> Hashable:
        """What is equal where the strands are, as far as can be told without reading all of them."""
        mesh = self._owner.data
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.attributes["position"].data.foreach_get("vector", points)
        systems = []
        for (_, system), numbers, steps in zip(self._systems, self._numbers, self._steps, strict=True):
            parents = range(len(system.particles))
            if not system.is_edited:
                parents = _sample(parents, _PARENTS)
            looked_at = [*parents, *_sample(numbers, _CHILDREN)]
            moves = time if system.use_hair_dynamics else None
            settings = (*_values(system.settings), *_values(system))
            systems.append((settings, numbers, steps, moves, digest(self._points(system, looked_at, steps))))
        return len(points), digest(points), tuple(systems)

    def strands(self, look: tuple[int, int]) -> Strands:
        """All of them, in object space; look: see `curves.strand_look`."""
        points, radii, counts, slots = [], [], [], []
        for (_, system), numbers, steps in zip(self._systems, self._numbers, self._steps, strict=True):
            settings = system.settings
            mine = self._points(system, numbers, steps)
            points.append(mine.reshape(-1, 3))
            radii.append(_radii(settings, mine).ravel())
            counts.append(np.full(len(numbers), steps))
            slots.append(np.full(len(numbers), settings.material - 1))
        offsets = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
        rows = np.concatenate(points), np.concatenate(radii), offsets
        return Strands(*rows, *look, np.concatenate(slots), name=self._owner.name)

    def uv(self, layer: int) -> np.ndarray:
        """Where each strand stands on a UV map of the emitter, (strands, 2)."""
        return self._on_emitter("uv_on_emitter", "uv_no", layer, 2)

    def color(self, layer: int) -> np.ndarray:
        """What a colour attribute of the emitter's is there, linear, (strands, 3)."""
        encoded = self._on_emitter("mcol_on_emitter", "vcol_no", layer, 3)
        return np.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)

    def _on_emitter(self, function: str, name: str, layer: int, components: int) -> np.ndarray:
        result = []
        for (modifier, system), numbers in zip(self._systems, self._numbers, strict=True):
            read, particles = getattr(system, function), system.particles
            own = list(particles)
            first = own[0]  # stands for children, of which the number alone counts
            values = (
                read(modifier, particle=own[i] if i < len(own) else first, particle_no=i, **{name: layer})
                for i in numbers
            )
            count = components * len(numbers)
            result.append(np.fromiter(chain.from_iterable(values), np.float32, count).reshape(-1, components))
        return np.concatenate(result)

    def _points(self, system, numbers: Iterable[int], steps: int) -> np.ndarray:
        """Points of strands, float32 (strands, steps, 3), in object space."""
        read, owner = system.co_hair, self._owner
        world = (read(object=owner, particle_no=i, step=k) for i in numbers for k in range(steps))
        points = np.fromiter(chain.from_iterable(world), np.float32, 3 * len(numbers) * steps).reshape(-1, 3)
        if system.settings.kink == "SPIRAL":
            _end(points.reshape(-1, steps, 3))
        points = points @ self._to_object[:3, :3].T + self._to_object[:3, 3]
        return points.astype(np.float32).reshape(-1, steps, 3)


def _numbers(system, is_render: bool) -> range:
    """Which of a system's strands are drawn, parents being counted first: children alone where there are any."""
    parents, children = len(system.particles), len(system.child_particles)
    if not is_render:
        children = int(children * system.settings.display_percentage / 100.0)
    has_children = system.settings.child_type != "NONE" and children > 0
    return range(parents if has_children else 0, parents + (children if has_children else 0))


def _steps(settings, is_render: bool) -> int:
    """How many points a strand has."""
    extra = settings.kink_extra_steps if settings.kink == "SPIRAL" else 0
    return 2 ** (settings.render_step if is_render else settings.display_step) + 1 + extra


def _end(points: np.ndarray) -> None:
    """Let strands (strands, steps, 3) that end before the last step stand still: Blender gives zeros for the rest."""
    for k in range(1, points.shape[1]):
        beyond = (points[:, k] == 0.0).all(axis=1)
        points[beyond, k] = points[beyond, k - 1]


def _radii(settings, points: np.ndarray) -> np.ndarray:
    """Radii (strands, steps) in object space: from root to tip by the length on the way, as Cycles shapes them."""
    along = np.cumsum(np.linalg.norm(np.diff(points, axis=1, prepend=points[:, :1]), axis=2), axis=1)
    total = along[:, -1:]
    t = np.where(total > 0.0, along / np.where(total > 0.0, total, 1.0), 0.0)
    shape = settings.shape
    power = 1.0 + shape if shape < 0.0 else 1.0 / max(1.0 - shape, 1e-6)
    root, tip = settings.root_radius, settings.tip_radius
    radii = 0.5 * settings.radius_scale * (tip + (root - tip) * np.maximum(1.0 - t, 0.0) ** power)
    if settings.use_close_tip:
        radii[:, -1] = 0.0
    return radii


def _sample(numbers: range, count: int) -> range:
    """About `count` numbers out of all, evenly."""
    return numbers[:: max(1, len(numbers) // count)]


def _values(owner) -> Iterable[tuple]:
    """All plain values of a datablock."""
    for prop in owner.bl_rna.properties:
        if prop.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"):
            value = getattr(owner, prop.identifier)
            yield tuple(value) if getattr(prop, "is_array", False) else _hashable(value)


def _hashable(value) -> Hashable:
    return frozenset(value) if isinstance(value, set) else value
