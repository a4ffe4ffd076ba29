"""Candidates of direct light: light samples and one direction by the BSDF, of which a pixel's reservoirs keep one each.

Resampled importance sampling (Talbot et al. 2005) of M light samples and one BSDF sample. Technique t, of which M_t
samples are drawn, is weighed by the balance heuristic, so that a sample of either has the resampling weight

    w = p̂ / (M p_light + p_bsdf)

with all three by solid angle: their ratio is the same by the coordinates that a reservoir keeps. (Light samples are
themselves resampled from tiles: their 1 / p_light is a contribution weight, and MIS goes by another density.) The
direction by the BSDF is that by which the path goes on afterwards, with what its ray has hit. It stands for the lights
that it finds whole; of others (hidden from some lobes, without shadows, without size) p_bsdf is 0 and only light
samples count.

Each light sample is a group with a shadow ray of its own; what the ray by the BSDF finds is another. A reservoir
resamples the groups by p̂ with V. Where no reuse follows, the vertex is lit by the sum of all groups instead. A p̂
without V asks for no V of what is not kept: then all are one group.
"""

from ....kernels.core import rng
from ....kernels.core.jit import inlined, kernel
from ....kernels.core.records import INTEGRATOR, SCENE, SCRATCH_LIGHT_SAMPLE, light_sample_at, path_at, tile_scene
from ....kernels.core.vec import add, scale, store3_f32, vec
from ....kernels.lights import light_sample, point_of_sample
from ....kernels.lights.mean_visibility import FIRST, mean_visibility
from ....kernels.lobes import bsdf_has_eval
from ....kernels.path.direct import lit_bsdf
from ...resampling.frame import FRAME, UNTRACED, hit_at
from ...resampling.inputs import point_at
from ...resampling.options import TARGET, reuse_at
from .bsdf_ray import bsdf_candidate
from .groups import close_group, settle, start_groups
from .streams import SAMPLED, found_by_rays, keep_point, offer, start_streams

# Key of the candidates' random numbers, and their dimensions.
_CANDIDATES = 0x43414E44
_DIM_LIGHT, _DIM_POINT, _DIM_CHOICE, _DIM_GROUP = 0, 1, 2, 3


@inlined
def _light_candidate(scene, reuse, layers, scratch, sp, key, index, count):
    """Stream one of `count` light samples, that of an index of random numbers; its part of the mean of all variates."""
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    u0, u1 = rng.sample2(key, index, _DIM_POINT)
    if light_sample(scene, sp, scratch, u0, u1, rng.sample1(key, index, _DIM_LIGHT)):
        f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
        ratio = pdf / (count * ls.mis_pdf) if found_by_rays(scene, ls) else 0.0
        factor = 1.0 / (ls.pdf * count * (1.0 + ratio))
        keepers = offer(reuse, layers, scratch, f, vec(ls.radiance), factor, ratio, SAMPLED)
        if keepers:
            source, primitive, x, y = point_of_sample(scene, sp, ls)
            keep_point(scratch, layers, keepers, source, primitive, x, y)
    return scale(vec(ls.control_variate), 1.0 / count)


@inlined
def _draw(scene, integrator, reuse, layers, frame, scratch, pixel, path, sp, key, last):
    """Draw all candidates of a vertex, group by group; stores what the ray by the BSDF hits, and the variate."""
    options = reuse_at(reuse, 0)
    apart = last != 0 or options.visibility == TARGET
    count = options.light_samples
    variate = (0.0, 0.0, 0.0)
    expected = mean_visibility(path.mean_visibility, FIRST)
    choice = rng.sample1(key, path.sample, _DIM_CHOICE)
    start_streams(scratch, layers, choice)
    for i in range(count):
        index = (path.sample * count + i) & 0xFFFFFFFF
        variate = add(variate, _light_candidate(scene, reuse, layers, scratch, sp, key, index, count))
        if apart:
            close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, True)
            start_streams(scratch, layers, choice)
    store3_f32(frame.control_variates, pixel, scale(variate, expected))
    hit = hit_at(frame.hits, pixel)
    bsdf_candidate(scene, integrator, reuse, layers, scratch, path, sp, hit, count)
    close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, False)


@kernel
def candidates_tile(scene: SCENE, integrator: INTEGRATOR, reuse, layers, frame: FRAME, scratch, x0, y0, x1, y1, last):
    """Fill the reservoirs of a tile. reuse: address of a REUSE for each of the layers of reservoirs.

    last: 0 where reuse follows; LAST, LAST_OF_FRAME: none does, so that frame.light is what lights.
    """
    scene = tile_scene(scene, scratch, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            sp = point_at(frame, pixel)
            scene.time = sp.time
            hit_at(frame.hits, pixel).instance = UNTRACED
            store3_f32(frame.control_variates, pixel, (0.0, 0.0, 0.0))
            path = path_at(frame.paths, pixel)
            key = rng.hash_combine(path.key, _CANDIDATES)
            start_groups(frame, reuse, layers, scratch, pixel, rng.sample1(key, path.sample, _DIM_GROUP))
            if sp.instance >= 0 and bsdf_has_eval(sp):
                _draw(scene, integrator, reuse, layers, frame, scratch, pixel, path, sp, key, last)
            settle(reuse, layers, frame, scratch, pixel, rng.hash_combine(key, path.sample), last)
