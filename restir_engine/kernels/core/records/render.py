"""A render in progress: the film, what the integrator is asked for, and the path that it follows."""

from ..memory import record_at
from .layout import record

FILM = record(
    "pixels",  # float32 [height, width, channels], rows bottom to top; sums over samples
    "width",
    "height",
    "channels",
    "active",  # bool [height, width], which pixels are to be sampled on; 0: all
    # Offset of each pass in a pixel, -1: not wanted. Names are `Pass.field` of settings.PASSES.
    "combined",
    "depth",
    "normal",
    "position",
    "uv",
    "object_index",
    "material_index",
    "diffuse_direct",
    "diffuse_indirect",
    "diffuse_color",
    "glossy_direct",
    "glossy_indirect",
    "glossy_color",
    "transmission_direct",
    "transmission_indirect",
    "transmission_color",
    "volume_direct",
    "volume_indirect",
    "emission",
    "environment",
    "subsurface",
    "subsurface_boundary",
    "subsurface_single",
    "subsurface_multiple",
    "denoising_albedo",
    "denoising_normal",
    "denoising_depth",
    "denoising_specular",
    "denoising_roughness",
    "mist",
    "vector",
    "vector_weight",
    "light_groups",  # LIGHT_GROUPS, 0: nobody asks what belongs to which
    "groups",  # the first channel of their passes, of three each
    # Slots of Cryptomatte, see kernels.film.cryptomatte.
    "crypto_object",
    "crypto_material",
    "crypto_asset",
    "ambient_occlusion",
    "roughness",
    "surroundings",
    "aovs",  # the first channel of what programs write, see kernels.film.surface_passes.write_aovs
    "alpha",  # what paths see of what is behind the picture: Combined's last channel
    "caught",  # light of paths that a shadow catcher has caught, see integrators.path.catchers
    "backdrop",  # the world behind catchers
    # Bits for the integrator: whether any pass of a kind is wanted.
    "light_passes",
    "data_passes",
    "summed",  # so many floats of a pixel are sums; behind them are slots
    "crypto_slots",  # a kind
    "more_data",  # code for data passes that few ask for, see kernels.film.more_data; 0: none of them is wanted
)
film_at = record_at(FILM)

INTEGRATOR = record(
    "seed",
    "max_bounces",
    "diffuse_bounces",
    "glossy_bounces",
    "transmission_bounces",
    "transparent_bounces",
    "volume_bounces",
    "transparent_path",  # transparent surfaces after which a path may only find light on its ray
    "min_bounces",
    "transparent_film",
    ("seen_through", 1),  # α_x α_y up to which what refracts shows a transparent film's background; below 0: nothing
    "filter_table",  # float32 [FILTER_TABLE_SIZE], see settings.filter_table
    "first_centered",  # 1: the first sample goes through the middle of its pixel
    ("clamp_direct", 1),  # inf: off
    ("clamp_indirect", 1),
    ("filter_glossy", 1),  # inf: off
    ("pass_alpha_threshold", 1),
    ("mist_start", 1),  # m
    ("mist_density", 1),  # 1 / m
    ("mist_power", 1),
    "graded_features",  # 1: of the denoiser, by `lobes.graded_features`
    ("occlusion_distance", 1),  # how far the pass Ambient Occlusion looks
    "after_diffuse",  # RAY_NO_REFLECTION, …, RAY_BURLEY_DIFFUSE: what is off after a diffuse bounce
    "scatter",  # int64: code of subsurface scattering and what it needs, see kernels.subsurface.method_table
    "max_scatters",  # scattering events that a random walk may have, with one more it ends unseen; -1: Cycles' 255
    "media",  # int64 [9]: code for media that paths cross; see kernels.volume.calls
)
integrator_at = record_at(INTEGRATOR)
FILTER_TABLE_SIZE = 1025

PATH = record(
    "pixel",  # address of the pixel's floats in the film
    "taker",  # address of the TAKER that takes contributions in place of the film; 0: none does
    "key",  # of the random numbers
    "mean_visibility",  # address of what kernels.lights.mean_visibility keeps of the pixel; 0: nothing
    "sample",
    "flags",  # RAY_* bits of the current ray
    "bounce",
    "diffuse_bounce",
    "glossy_bounce",
    "transmission_bounce",
    "transparent_bounce",
    "volume_bounce",
    "boundaries",  # invisible boundaries of media that were passed
    "dimension",  # first random dimension of the current vertex
    "background_visible",  # nothing but transparency so far: alpha and data passes are still written
    "caught",  # 1: what was seen first, but for transparency, is a shadow catcher
    "data_done",
    "denoise",  # denoising features are still to be written
    "last",  # no more lobes: only emission and transparency
    "first_in_medium",  # the first bounce was in a medium
    "scattering",  # class of the first scattering below a surface, see kernels.film.contribute; 0: none so far
    ("o", 3),
    ("d", 3),
    ("tmin", 1),
    "left",  # the instance that the ray comes out of, and 1; 0: of none, or of none that something could touch
    ("run_up", 1),  # then how far before o it begins, see kernels.geometry.leaving
    ("t", 1),  # where the ray ends, for the code of media
    ("time", 1),  # 0: the shutter opens, 1: it closes
    ("medium_start", 1),  # where on the ray the present medium begins, while tmin > 0
    ("throughput", 3),
    ("diffuse_share", 3),  # of each class of lobes at the first bounce, for the light passes
    ("glossy_share", 3),
    ("feature_throughput", 3),
    ("mis_pdf", 1),  # solid-angle pdf of d at o; 0: not found by light sampling, counts fully
    "receiver_set",  # the light set of what lies at o
    ("receiver", 3),  # how light sampling chose at o, see SHADING_POINT
    ("light_shares", 3),
    ("min_pdf", 1),
    ("dp", 1),
    ("dd", 1),
)
path_at = record_at(PATH)

TAKER = record(  # what takes a path's contributions in place of the film begins with this
    "code",  # (taker, PATH, kind, source, light group) -> 1: it has taken `value`; 0: the film shall have it
    ("value", 3),  # throughput and MIS weight included
    ("light_pdf", 1),  # by solid angle, of light sampling where the path's ray has found the light; 0: no MIS
)
taker_at = record_at(TAKER)
