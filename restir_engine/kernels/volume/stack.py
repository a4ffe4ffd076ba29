"""The media that contain a point: MEDIA, followed by one MEDIUM for each closed mesh around it, at an address.

A path enters a mesh at a front side and leaves it at a back side, as in Cycles; the world's medium is everywhere.
Where media overlap, those of the highest priority count, and add up. Those that vary in space are asked for their
coefficients at points (`point`), and are in none of the sums.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import copy_words, load_i32, load_i64, record_address, store_i64
from ..core.records import (
    MATERIAL_MEDIUM_VARIES,
    MAX_MEDIA,
    MAX_PHASES,
    MEDIA,
    MEDIUM,
    PHASE,
    RAY_SHADOW,
    SCENE_WORLD_MEDIUM,
    closure_at,
    instance_at,
    majorants_at,
    material_at,
    media_at,
    medium_at,
)
from ..core.vec import add, put, scale, vec
from ..shading.interpreter import medium_eval
from .calls import BESIDE_LAMPS

OVERFLOWS = BESIDE_LAMPS + 1  # index in INTEGRATOR.media, behind the code: how often there was no room for a medium
_FIRST = MEDIA.itemsize
_WORDS = MEDIUM.itemsize // 8
_HEAD = MEDIUM.fields["phases"][1] // 8
_WALK = MEDIUM.fields["walk"][1]


@inlined
def entry_at(media, index):
    """The index-th MEDIUM of the MEDIA at an address."""
    return medium_at(media + _FIRST, index)


@inlined
def walk_of(media, index):
    """The address of the WALK of the index-th MEDIUM."""
    return record_address(entry_at(media, index)) + _WALK


@device
def decay(sigma, s):
    """exp(-σ s) by channel; 1 where σ is 0, however long s is."""
    return (
        math.exp(-sigma[0] * s) if sigma[0] > 0.0 else 1.0,
        math.exp(-sigma[1] * s) if sigma[1] > 0.0 else 1.0,
        math.exp(-sigma[2] * s) if sigma[2] > 0.0 else 1.0,
    )


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
    varying = 0
    for i in range(m.count):
        entry = entry_at(media, i)
        if entry.priority != top:
            continue
        if entry.majorants != 0:
            varying += 1
        else:
            sigma_t = add(sigma_t, vec(entry.sigma_t))
            sigma_s = add(sigma_s, vec(entry.sigma_s))
            emission = add(emission, vec(entry.emission))
    m.top = top
    m.varying = varying
    m.chosen = -1
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


@inlined
def innermost(media):
    """The instance that the path has entered last, -1: it is in the world's medium: whose light group has all that
    overlapping media emit, as in Cycles."""
    return entry_at(media, media_at(media, 0).count - 1).instance


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
    material = material_at(scene.materials, sp.material)
    entry.priority = material.medium_priority
    entry.majorants = 0
    if material.flags & MATERIAL_MEDIUM_VARIES:
        entry.majorants = _majorants(scene, sp)
    if entry.majorants == 0:
        evaluate(scene, entry, sp)
    else:
        majorants = majorants_at(entry.majorants, 0)
        if majorants.voxels != 0:
            entry.n_phases = majorants.n_phases
            for k in range(PHASE * majorants.n_phases):
                entry.phases[k] = majorants.phases[k]
    add_up(media)


@device
def _majorants(scene, sp):
    """The MAJORANTS of the medium behind sp, which varies."""
    if sp.instance < 0:
        return scene.world_majorants
    placed = instance_at(scene.instances, sp.instance)
    for k in range(placed.n_materials):
        if load_i32(scene.material_slots, placed.materials + k) == sp.material:
            return load_i64(placed.majorants, k)
    return 0


@device
def evaluate(scene, entry, sp):
    """Fill a MEDIUM by its program at sp, which loses its closures. In shadow rays media have no phase functions."""
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
    density = instance_at(scene.instances, sp.instance).volume_density if sp.instance >= 0 else 1.0
    if density != 1.0:
        put(entry.sigma_t, scale(vec(entry.sigma_t), density))
        put(entry.sigma_s, scale(sigma_s, density))
        put(entry.emission, scale(vec(entry.emission), density))


@device
def only_world(scene, integrator, media, point):
    """Let the world's medium, if it has one, be the only one at an address; `point` is used for its program."""
    m = media_at(media, 0)
    m.count = 0
    m.varying = 0
    if scene.flags & SCENE_WORLD_MEDIUM:
        point.instance = -1
        point.primitive = -1
        point.light = -1
        point.material = scene.world_material
        enter(scene, integrator, media, point)


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
        if entry.instance < 0 or instance_at(scene.instances, entry.instance).seen_by & RAY_SHADOW:
            copy_words(record_address(entry_at(target, m.count)), record_address(entry), _HEAD)
            m.count += 1
    add_up(target)
