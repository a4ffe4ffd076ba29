"""The one way by which light reaches the film.

A path streams contributions: a value (rgb, throughput and MIS weight included) and WHAT it is. How many bounces lie
between the light and the eye, and thereby clamps and passes, follow from the path and from that. Passes that describe
the first surface are no light: `surface_passes`.
"""

from typing import NamedTuple

from ..core.jit import device, inlined
from ..core.memory import call_for_outcome, load_f32, record_address, store_f32
from ..core.records import POINT_ON_LAMP, POINT_ON_WORLD, instance_at, light_at, light_groups_at, taker_at
from ..core.vec import LARGEST_RADIANCE, average, is_black, load3_f32, mul, put, vec
from ..lobes.classes import NO_LOBES, Lobes, lobe_sum, share

# Where light comes from (What.kind). By the path's own ray: what lamps, surfaces and media emit; the world; the world
# behind a transparent film, which is no part of Combined. By a light sample at the path's vertex: DIRECT.
# Light that was resampled from whole paths, all of it behind the vertex: INDIRECT.
EMISSION, ENVIRONMENT, BACKDROP, DIRECT, INDIRECT = 0, 1, 2, 3, 4

# Where light comes from, where it is no lamp (What.source; the first two are LIGHT_SAMPLE.light). NOT_FOUND: not asked.
ON_SURFACE, IN_WORLD, IN_MEDIUM, NOT_FOUND = -1, -2, -3, -4
NO_GROUP = -1  # in place of the number of a light group

# By what light was scattered below a surface at the first time (PATH.scattering, What.scattering); 0: it was not.
BOUNDARY, SINGLE, MULTIPLE = 1, 2, 3


class What(NamedTuple):
    """What a contribution is, besides its value; made by `found`, `lit` and `lit_at_exit`."""

    kind: int  # EMISSION …
    lobes: Lobes  # of DIRECT: the BSDF at the vertex by classes, of which the shares count
    scattering: int  # 0, BOUNDARY …
    source: int  # the lamp that the light comes from, ON_SURFACE …
    instance: int  # of that surface or medium, -1: none
    light_pdf: float  # solid-angle density with which light sampling finds it; 0: no MIS


@inlined
def found(path, kind, source, instance, light_pdf):
    """What the path's own ray has found; source, instance, light_pdf: see What."""
    return What(kind, NO_LOBES, path.scattering, source, instance, light_pdf)


@inlined
def lit(path, lobes, ls):
    """The LIGHT_SAMPLE ls at the path's vertex."""
    return What(DIRECT, lobes, path.scattering, ls.light, ls.instance, 0.0)


@inlined
def lit_by_several(path, lobes):
    """Several light samples at the path's vertex in one; their light groups are for `contribute_to_groups`."""
    return What(DIRECT, lobes, path.scattering, NOT_FOUND, -1, 0.0)


@inlined
def lit_indirectly(path, lobes):
    """Light from behind the path's vertex, that has been resampled; its light groups likewise."""
    return What(INDIRECT, lobes, path.scattering, NOT_FOUND, -1, 0.0)


@inlined
def lit_at_exit(path, lobes, events, source, instance):
    """A light sample where light leaves an object after so many scattering events below its surface.

    source, instance: LIGHT_SAMPLE.light, .instance; or NOT_FOUND and -1, as in `lit_by_several`.
    """
    return What(DIRECT, lobes, first_scattering(path, events), source, instance, 0.0)


@inlined
def first_scattering(path, events):
    """The class of the path's first scattering below a surface, of which the latest has had so many events."""
    return path.scattering if path.scattering != 0 else min(BOUNDARY + events, MULTIPLE)


@inlined
def contribute(integrator, film, path, value, what):
    """Hand on what light a path has found, to the pixel that `path.pixel` points to: all of it passes here.

    That pixel is the film's, or with RESTIR the frame's. What takes a path's contributions instead, its TAKER, takes
    them here and clamps for itself; it does not get the world behind a transparent film.
    """
    if is_black(value):
        return
    group = NO_GROUP
    if film.light_groups != 0:
        group = light_group(film.light_groups, what.source, what.instance)
    if path.taker != 0 and what.kind != BACKDROP and path.caught == 0:
        taker = taker_at(path.taker, 0)
        put(taker.value, value)
        taker.light_pdf = what.light_pdf
        address = record_address(path)
        if call_for_outcome(taker.code, path.taker, address, what.kind, what.source, group):
            _add_to_albedo(film, path, value, what)
            return
        value = vec(taker.value)
    bounces = path.bounce
    if what.kind == DIRECT:
        bounces += 1
    elif what.kind == INDIRECT:
        bounces += 2
    if what.kind != BACKDROP:
        value = _scaled(value, _clamp(integrator, value, bounces))
    _add_to_pixel(film, path, value, what, bounces)
    if group >= 0 and film.groups >= 0 and path.caught == 0:
        add3(path.pixel, film.groups + 3 * group, value)


@device
def contribute_to_groups(integrator, film, path, value, light):
    """Share out what `lit_by_several` has contributed as `value`, or light that is not clamped, to the light groups.

    light: address of float32 [groups, 3], without the path's throughput.
    """
    if film.light_groups == 0 or film.groups < 0 or path.caught != 0:
        return
    s = _clamp(integrator, value, path.bounce + 1)
    for group in range(light_groups_at(film.light_groups, 0).count):
        c = mul(load3_f32(light, group), vec(path.throughput))
        if abs(c[0]) + abs(c[1]) + abs(c[2]) <= LARGEST_RADIANCE:
            add3(path.pixel, film.groups + 3 * group, _scaled(c, s))


@device
def light_group(groups, source, instance):
    """The number of the light group that a source (What) belongs to, NO_GROUP: to none; groups: of LIGHT_GROUPS."""
    groups = light_groups_at(groups, 0)
    if source >= 0:
        return light_at(groups.lights, source).light_group
    if source == IN_WORLD:
        return groups.world
    if instance >= 0:
        return instance_at(groups.instances, instance).light_group
    return groups.world_medium if source == IN_MEDIUM else NO_GROUP


@inlined
def let_through(film, path, share):
    """A share of the path sees what is behind the picture: the sum in the alpha channel is what is missing."""
    if film.alpha >= 0:
        add1(path.pixel, film.alpha, share * average(vec(path.throughput)))


@inlined
def catch(film, path):
    """A shadow catcher has caught the path: there is nothing in Combined, and what it finds is the catcher's light."""
    if film.combined >= 0:
        let_through(film, path, 1.0)
    path.caught = 1


@inlined
def wants_world_behind(film):
    """Whether anybody takes the world that shadow catchers lie before."""
    return film.backdrop >= 0


@inlined
def add_world_behind(film, path, radiance):
    """Add the world straight ahead, as if no shadow catcher lay before it."""
    add3(path.pixel, film.backdrop, mul(vec(path.throughput), radiance))


@inlined
def is_wanted(film, path):
    """Whether the film takes what a path may still find, but for what it sees straight ahead."""
    return (film.caught if path.caught != 0 else film.combined) >= 0


@inlined
def sample_group(film, ls):
    """The number of the light group of a LIGHT_SAMPLE, NO_GROUP where nobody asks."""
    return light_group(film.light_groups, ls.light, ls.instance) if film.light_groups != 0 else NO_GROUP


@inlined
def point_group(groups, source, primitive):
    """The number of the light group of a light's point (kernels.lights.points); groups: LIGHT_GROUPS, 0: NO_GROUP."""
    if groups == 0:
        return NO_GROUP
    if primitive == POINT_ON_LAMP:
        return light_group(groups, source, -1)
    return light_group(groups, IN_WORLD if primitive == POINT_ON_WORLD else ON_SURFACE, source)


@inlined
def wants_backdrop(film):
    """Whether anybody takes the world behind a transparent film; if so, its light group does too, as in Cycles."""
    return film.environment >= 0


@inlined
def _clamp(integrator, c, bounces):
    """By what a contribution is to be scaled, so that its channels add up to the limit at most; not finite: by 0."""
    limit = integrator.clamp_indirect if bounces > 1 else integrator.clamp_direct
    total = abs(c[0]) + abs(c[1]) + abs(c[2])
    if not total <= LARGEST_RADIANCE:
        return 0.0
    return limit / total if total > limit else 1.0


@inlined
def _scaled(c, s):
    """s c, and black where s is 0, whatever c is."""
    return (c[0] * s, c[1] * s, c[2] * s) if s > 0.0 else (0.0, 0.0, 0.0)


@inlined
def _add_to_pixel(film, path, c, what, bounces):
    """Add a contribution to Combined and to the passes that it belongs to."""
    if what.kind == BACKDROP:
        add3(path.pixel, film.environment, c)
        return
    if path.caught != 0:
        add3(path.pixel, film.caught, c)
        return
    add3(path.pixel, film.combined, c)
    if bounces == 0:
        add3(path.pixel, film.environment if what.kind == ENVIRONMENT else film.emission, c)
    elif film.light_passes > 0:
        _add_by_first_bounce(film, path, c, what.lobes, bounces > 1)
    if what.scattering != 0:
        _add_by_scattering(film, path, c, what.scattering)
    _add_to_albedo(film, path, c, what)


@inlined
def _add_to_albedo(film, path, c, what):
    """Add what the path's own ray has found to the denoiser's albedo, before the first diffuse surface."""
    if what.kind < DIRECT and path.denoise and film.denoising_albedo >= 0:
        add3(path.pixel, film.denoising_albedo, mul(vec(path.feature_throughput), c))


@device
def _add_by_first_bounce(film, path, c, lobes, indirect):
    """Add to the light passes by the shares of the classes of lobes at the first bounce, which may be that here."""
    if path.first_in_medium:
        add3(path.pixel, film.volume_indirect if indirect else film.volume_direct, c)
        return
    diffuse, glossy = vec(path.diffuse_share), vec(path.glossy_share)
    if path.bounce == 0:
        diffuse, glossy = class_shares(lobes)
    d = mul(c, diffuse)
    g = mul(c, glossy)
    t = (c[0] - d[0] - g[0], c[1] - d[1] - g[1], c[2] - d[2] - g[2])
    add3(path.pixel, film.diffuse_indirect if indirect else film.diffuse_direct, d)
    add3(path.pixel, film.glossy_indirect if indirect else film.glossy_direct, g)
    add3(path.pixel, film.transmission_indirect if indirect else film.transmission_direct, t)


@inlined
def class_shares(lobes):
    """(diffuse, glossy) rgb: the shares of these classes in the sum; what is missing to 1 is transmission."""
    total = lobe_sum(lobes)
    d, g = lobes.diffuse, lobes.glossy
    return (
        (share(d[0], total[0]), share(d[1], total[1]), share(d[2], total[2])),
        (share(g[0], total[0]), share(g[1], total[1]), share(g[2], total[2])),
    )


@device
def _add_by_scattering(film, path, c, scattering):
    """Add to the passes of the first scattering below a surface."""
    add3(path.pixel, film.subsurface, c)
    part = film.subsurface_multiple
    if scattering == BOUNDARY:
        part = film.subsurface_boundary
    elif scattering == SINGLE:
        part = film.subsurface_single
    add3(path.pixel, part, c)


@inlined
def add1(pixel, offset, x):
    """Add to a channel of a pixel, whose floats begin at an address."""
    store_f32(pixel, offset, load_f32(pixel, offset) + x)


@inlined
def add3(pixel, offset, c):
    """Add to three channels of a pixel; an offset of -1 is a pass that nobody wants."""
    if offset >= 0:
        add1(pixel, offset, c[0])
        add1(pixel, offset + 1, c[1])
        add1(pixel, offset + 2, c[2])
