"""The media that contain a point: MEDIA, followed by one MEDIUM for each closed mesh around it, at an address.

A path enters a mesh at a front side and leaves it at a back side, as in Cycles. Where media overlap, those of the
highest priority count, and add up.
"""

from ..core.jit import device, inlined
from ..core.memory import copy_words, load_i64, record_address, store_i64
from ..core.records import (
    MAX_MEDIA,
    MAX_PHASES,
    MEDIA,
    MEDIUM,
    PHASE,
    RAY_SHADOW,
    closure_at,
    instance_at,
    material_at,
    media_at,
    medium_at,
)
from ..core.vec import add, put, vec
from ..shading.interpreter import medium_eval
from .calls import SHADOW_RAY

OVERFLOWS = SHADOW_RAY + 1  # index in INTEGRATOR.media, behind the code: how often there was no room for a medium
_FIRST = MEDIA.itemsize
_WORDS = MEDIUM.itemsize // 8
_HEAD = (MEDIUM.itemsize - 8 * MAX_PHASES * PHASE) // 8


@inlined
def entry_at(media, index):
    """The index-th MEDIUM of the MEDIA at an address."""
    return medium_at(media + _FIRST, index)


@device
def add_up(media):
    """Bring the sums of the MEDIA at an address up to date."""
    m = media_at(media, 0)
    top = -(1 << 62)
    for i in range(m.count):
        top = max(top, entry_at(media, i).priority)
    sigma_t = (0.0, 0.0, 0.0)
    sigma_s = (0.0, 0.0, 0.0)
    emission = (0.0, 0.0, 0.0)
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority == top:
            sigma_t = add(sigma_t, vec(entry.sigma_t))
            sigma_s = add(sigma_s, vec(entry.sigma_s))
            emission = add(emission, vec(entry.emission))
    m.top = top
    put(m.sigma_t, sigma_t)
    put(m.sigma_s, sigma_s)
    put(m.emission, emission)


@device
def find(media, instance, material):
    """The index of the medium of a mesh, -1: the point is not inside."""
    for i in range(media_at(media, 0).count):
        entry = entry_at(media, i)
        if entry.instance == instance and entry.material == material:
            return i
    return -1


@device
def enter(scene, integrator, media, sp):
    """Add the medium behind the surface at sp, by its program there; sp loses its closures.

    More than MAX_MEDIA are not kept, but counted.
    """
    m = media_at(media, 0)
    if find(media, sp.instance, sp.material) >= 0:
        return
    if m.count >= MAX_MEDIA:
        store_i64(integrator.media, OVERFLOWS, load_i64(integrator.media, OVERFLOWS) + 1)
        return
    entry = entry_at(media, m.count)
    m.count += 1
    entry.instance = sp.instance
    entry.material = sp.material
    entry.priority = material_at(scene.materials, sp.material).medium_priority
    medium_eval(scene, sp)
    sigma_s = (0.0, 0.0, 0.0)
    n = min(sp.n_closures, MAX_PHASES)
    for i in range(n):
        c = closure_at(sp.closures, i)
        sigma_s = add(sigma_s, vec(c.weight))
        entry.phases[PHASE * i] = float(c.kind)
        entry.phases[PHASE * i + 1] = c.sample_weight
        for k in range(3):
            entry.phases[PHASE * i + 2 + k] = c.p[k]
    entry.n_phases = n
    t = sp.transparent
    put(entry.sigma_t, (max(t[0], sigma_s[0]), max(t[1], sigma_s[1]), max(t[2], sigma_s[2])))
    put(entry.sigma_s, sigma_s)
    put(entry.emission, vec(sp.emission))
    add_up(media)


@device
def leave(media, instance, material):
    """Remove the medium of a mesh."""
    i = find(media, instance, material)
    if i < 0:
        return
    m = media_at(media, 0)
    m.count -= 1
    source = record_address(entry_at(media, i))
    copy_words(source, source + 8 * _WORDS, _WORDS * (m.count - i))
    add_up(media)


@device
def cross(scene, integrator, media, sp):
    """Go through the boundary at sp: enter at a front side, leave at a back side."""
    if sp.backfacing:
        leave(media, sp.instance, sp.material)
    else:
        enter(scene, integrator, media, sp)


@device
def copy_for_shadow(scene, source, target):
    """Copy MEDIA without phase functions, and without those of meshes that cast no shadow."""
    m = media_at(target, 0)
    m.count = 0
    for i in range(media_at(source, 0).count):
        entry = entry_at(source, i)
        if instance_at(scene.instances, entry.instance).seen_by & RAY_SHADOW:
            copy_words(record_address(entry_at(target, m.count)), record_address(entry), _HEAD)
            m.count += 1
    add_up(target)
