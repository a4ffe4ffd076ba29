"""The bounce: a direction by the BSDF, and the path's next ray."""

from ...kernels.core import rng
from ...kernels.core.jit import inlined
from ...kernels.core.vec import max3, mul, normalize, put, scale, vec
from ...kernels.film.contribute import class_shares
from ...kernels.geometry.surface import offset_origin
from ...kernels.lobes import bsdf_sample
from ...kernels.lobes.classes import lobe_sum
from ...kernels.lobes.closure import LABEL_DIFFUSE, LABEL_SUBSURFACE, LABEL_TRANSMIT, LABEL_TRANSPARENT
from ...kernels.path.state import DIM_DIRECTION, DIM_LOBE, ENDS, ENTERS, GOES_ON, next_ray, next_state, pass_through


@inlined
def bounce(scene, integrator, path, sp):
    """Sample the lobes at sp, and return the path's next event: ENDS, GOES_ON with its next ray, or ENTERS."""
    if sp.n_closures == 0:
        return ENDS
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    label, wi, f, pdf = bsdf_sample(scene, sp, u0, u1, u2)
    total = lobe_sum(f)
    if label == 0 or pdf <= 0.0 or max3(total) <= 0.0:
        return ENDS
    if label & LABEL_TRANSPARENT:
        return pass_through(integrator, path, sp, scale(total, 1.0 / pdf))
    put(path.throughput, scale(mul(vec(path.throughput), total), 1.0 / pdf))
    if path.bounce == 0:
        diffuse, glossy = class_shares(f)
        put(path.diffuse_share, diffuse)
        put(path.glossy_share, glossy)
    if label & LABEL_SUBSURFACE:
        return ENTERS
    next_ray(path, sp, offset_origin(sp, wi), normalize(wi))
    sees_behind = path.background_visible > 0 and label & (LABEL_TRANSMIT | LABEL_DIFFUSE) == LABEL_TRANSMIT
    next_state(path, integrator, label, pdf)
    if sees_behind and sp.sampled_alpha_squared <= integrator.seen_through:
        path.background_visible = 1
    return GOES_ON
