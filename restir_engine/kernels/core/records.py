"""The records through which scene, settings and working memory reach kernels.

An array stands in a record as its address (int64; 0: none) and, where needed, its length. The Python side
(`scene`, `session`) owns every array. A kernel takes records, so that its argument types never depend on the scene.
All matrices are row-major 3x4. Units are Blender's: scene units, radians, scene-linear radiance.
"""

import numpy as np

from .memory import record_at


def _record(*fields) -> np.dtype:
    """A dtype from names of int64 fields, and (name, "f" or count) pairs for float64 fields."""
    result = []
    for field in fields:
        if isinstance(field, str):
            result.append((field, np.int64))
        else:
            name, shape = field
            result.append((name, np.float64) if shape == 1 else (name, np.float64, (shape,)))
    return np.dtype(result)


# Geometry -------------------------------------------------------------------------------------------------

# Attribute domains.
DOMAIN_POINT, DOMAIN_CORNER, DOMAIN_FACE, DOMAIN_MESH = 0, 1, 2, 3

# Interned names with a meaning of their own; see scene.names.
ATTRIBUTE_UV, ATTRIBUTE_GENERATED = 0, 1

ATTRIBUTE = _record(
    "name",  # interned, see Scene.attribute_names; 0 is the active render UV map
    "domain",
    "components",  # 1 to 4 floats an element
    "values",  # float32 [elements, components]
)

MESH = _record(
    "vertices",  # float32 [n_vertices, 3]
    "n_vertices",
    "triangles",  # uint32 [n_triangles, 3], vertex indices
    "n_triangles",
    "corners",  # uint32 [n_triangles, 3], indices into DOMAIN_CORNER arrays
    "polygons",  # int32 [n_triangles], indices into DOMAIN_FACE arrays
    "normals",  # float32 [points or corners, 3], object space; 0: flat
    "normals_domain",  # DOMAIN_POINT or DOMAIN_CORNER
    "smooth",  # uint8 [n_triangles], 0: this triangle is flat; address 0: all smooth when normals is set
    "material_slots",  # int32 [n_triangles], slot of the object; address 0: all 0
    "attributes",  # ATTRIBUTE [n_attributes]
    "n_attributes",
    "embree",  # RTCScene of this mesh alone (bottom level)
    ("generated_offset", 3),  # generated = (p - offset) * scale, in object space
    ("generated_scale", 3),
)

INSTANCE = _record(
    "mesh",  # index into meshes
    "materials",  # start in material_slots
    "n_materials",
    "visibility",  # RAY_* bits of the rays that see it
    "flags",  # INSTANCE_* bits
    "object_index",  # pass_index of the object
    "key",  # the same in every frame of an animation, and nobody else's
    "lights",  # start of this instance's triangles in the table of emissive triangles, -1: none
    "attributes",  # ATTRIBUTE [n_attributes] of this instance (DOMAIN_MESH): properties of the object
    "n_attributes",
    ("random", 1),  # Object Info > Random
    ("color", 4),
    ("location", 3),
    ("to_world", 12),
    ("to_object", 12),
    ("dupli_generated", 3),  # the instancer's texture coordinates
    ("dupli_uv", 2),
    ("particle", 1),  # particle random, 0 when there is none
    ("terminator", 1),  # cosine below which shadow rays start above smooth triangles, see interaction.shadow_origin
)
INSTANCE_MIRRORED = 1  # the matrix has a negative determinant
INSTANCE_HOLDOUT = 2
INSTANCE_SHADOW_CATCHER = 4

# Ray types, the same bits as path flags of Light Path and as visibility of instances and lights.
RAY_CAMERA = 1
RAY_REFLECT = 2
RAY_TRANSMIT = 4
RAY_DIFFUSE = 8
RAY_GLOSSY = 16
RAY_SINGULAR = 32
RAY_TRANSPARENT = 64
RAY_VOLUME = 128
RAY_SHADOW_OPAQUE = 256  # shadow rays against instances none of whose materials lets light through
RAY_SHADOW_TRANSPARENT = 512  # shadow rays against the others
RAY_SHADOW = RAY_SHADOW_OPAQUE | RAY_SHADOW_TRANSPARENT
RAY_EMISSION = 1024  # a program is run for its emission only (a light sampled by next event estimation)
RAY_LAST = 2048  # the path ends here: only emission and transparency are wanted
RAY_NO_LOBES = RAY_SHADOW | RAY_EMISSION | RAY_LAST  # programs make no BSDF closures when one of these is set
RAY_NO_REFLECTION = 4096  # caustics are off, and the ray comes from a diffuse bounce: no lobes that mirror
RAY_NO_REFRACTION = 8192  # nor any that refract
RAY_SUBSURFACE_DIFFUSE = 16384  # subsurface scattering of every method is rendered as diffuse
RAY_BURLEY_DIFFUSE = 32768  # that of BURLEY is
RAY_ALL = 1023

# Shading ------------------------------------------------------------------------------------------------

MATERIAL = _record(
    "code",  # start of the surface program in `code`, -1: none (black, no emission)
    "constants",  # start of its constants in `constants` (float64)
    "n_constants",  # copied to registers 0 … n_constants before the program runs
    "flags",  # MATERIAL_* bits
    "pass_index",
    "emission_sampling",  # 0 none, 1 auto, 2 front, 3 back, 4 both
    "medium",  # start of the program of the medium inside in `code`, -1: none; it uses the same constants
    "medium_priority",  # where media overlap, those of the highest priority count
    ("emission_estimate", 3),  # radiance; only about right with MATERIAL_VARYING_EMISSION; 0: does not emit
    ("lambert", 3),  # weight of the one lobe of MATERIAL_LAMBERT
)
MATERIAL_EMITS = 1
MATERIAL_LAMBERT = 8  # nothing but a Lambert lobe of weight `lambert`: the program need not run
MATERIAL_TRANSPARENT = 2  # may let shadow rays through
MATERIAL_VARYING_EMISSION = 4  # emission depends on the point or the direction (a texture, a coat)
MATERIAL_SUBSURFACE = 16  # may make a LOBE_SUBSURFACE: its meshes have a bottom-level scene
MATERIAL_BUMPED_EXIT = 32  # its subsurface lobes have normals of their own: light leaves by these
MATERIAL_MEDIUM = 64  # has a medium inside
MATERIAL_BOUNDARY = 128  # nothing but the invisible boundary of a medium: rays pass without a bounce

IMAGE = _record(
    "pixels",  # float32 or uint8 [height, width, 4] rows bottom to top, alpha associated
    "width",
    "height",
    "flags",  # IMAGE_* bits
    "decode",  # float32 [IMAGE_DECODE + 1]: encoded colour in [0, 1] to scene linear, after filtering; 0: linear
)
IMAGE_BYTES = 1  # pixels are uint8
IMAGE_DECODE = 1024

CLOSURE = _record(
    "kind",  # LOBE_* of kernels.lobes
    ("weight", 3),
    ("sample_weight", 1),
    ("n", 3),
    ("t", 3),
    ("alpha_x", 1),
    ("alpha_y", 1),
    ("ior", 1),
    ("p", 16),  # what else the lobe needs; each lobe module names its own
)
MAX_CLOSURES = 32
MAX_REGISTERS = 2048

SHADING_POINT = _record(
    "instance",  # -1: none (world or light)
    "primitive",
    "mesh",
    "material",  # index into materials: the program that runs
    "light",  # index into lights when a light's program runs, else -1
    "backfacing",
    "ray_flags",  # RAY_* bits of the path that arrives
    "depth",
    "diffuse_depth",
    "glossy_depth",
    "transmission_depth",
    "transparent_depth",
    "closures",  # address of CLOSURE [MAX_CLOSURES]
    "n_closures",
    "scatterer",  # the closure that bsdf_sample chose with LABEL_SUBSURFACE
    "registers",  # address of float64 [MAX_REGISTERS]
    ("t", 1),  # length of the ray that arrived
    ("u", 1),  # barycentric weights of corners 1 and 2 on a triangle; parametric on a light
    ("v", 1),
    ("time", 1),
    ("p", 3),
    ("error", 1),  # what p and a ray from p may be wrong by in single precision
    ("n", 3),  # shading normal, on the side of wo's geometric side
    ("ng", 3),  # geometric normal, flipped to the side of wo
    ("wo", 3),  # unit, towards where the ray came from
    ("dpdu", 3),  # by barycentric u and v, world space
    ("dpdv", 3),
    ("dp", 1),  # radius of the ray's footprint at p
    ("dd", 1),  # its growth by unit of distance
    ("receiver", 3),  # normal by which light sampling weighed lamps where this path's ray began; zero: by none
    # What the program wrote:
    ("emission", 3),
    ("transparent", 3),  # weight of transparent closures
    ("holdout", 1),
)

# Lights and world -----------------------------------------------------------------------------------------

LIGHT_POINT, LIGHT_SPOT, LIGHT_AREA, LIGHT_SUN = 0, 1, 2, 3

LIGHT = _record(
    "kind",  # LIGHT_POINT …
    "material",  # program, -1: constant emission of 1
    "visibility",  # RAY_* bits of the rays that see its light, by what they are at the point that is lit
    "flags",  # LIGHT_* bits
    "object_index",
    "key",  # likewise
    "max_bounces",  # a path that arrives with more bounces does not sample it
    ("to_world", 12),
    ("to_object", 12),
    ("strength", 3),  # radiance of a light with a size, intensity of a delta point or spot, irradiance of a delta sun
    ("center", 3),  # world space
    ("radius", 1),  # of a bounding sphere about the centre
    ("importance", 1),  # mean intensity (watt by steradian; sun: irradiance), for choosing between lights
    ("p", 16),  # what else the kind needs; see kernels.lights
)
LIGHT_HITTABLE = 1  # rays made by BSDF sampling find it
LIGHT_NO_SHADOW = 2
LIGHT_SPHERE = 4  # point and spot: a sphere; else a disk that turns towards the point that is lit
LIGHT_ELLIPSE = 8  # area: elliptic
LIGHT_DELTA = 16  # no size: next event estimation alone finds it

LIGHT_SAMPLE = _record(
    "light",  # light index, -1: emissive triangle, -2: world
    "flags",
    "visibility",  # RAY_DIFFUSE, RAY_GLOSSY, RAY_TRANSMIT: the parts of the BSDF that this light reaches
    ("wi", 3),
    ("distance", 1),  # inf for sun and world
    ("p", 3),
    ("ng", 3),
    ("pdf", 1),  # solid angle, selection included; of delta lights (LIGHT_SAMPLE_DELTA) the selection's probability
    ("radiance", 3),  # of delta lights the irradiance at normal incidence, so that radiance / pdf is right for all
    ("uv", 2),
    "instance",  # of an emissive triangle
    "primitive",
    ("mis_pdf", 1),  # solid angle: what MIS weighs it by; pdf itself, but where it was resampled from a tile
    ("point_pdf", 1),  # solid-angle density of 1 in the measure of kernels.lights.points, as light_point left it
    ("variate", 3),  # of mean 0, to be added times a guess of V: all candidates of a tile less the chosen one
)
LIGHT_SAMPLE_DELTA = 1
LIGHT_SAMPLE_NO_SHADOW = 2

# A pair of an alias table: bin i is chosen below `threshold`, else `alias`.
ALIAS = np.dtype([("threshold", np.float32), ("alias", np.int32)])

EMITTER_GROUP = _record(  # the emissive triangles of one mesh under one list of materials
    "n",
    "alias",  # ALIAS [n]
    "primitives",  # int32 [n]
    "probabilities",  # float32 [n_triangles of the mesh], 0: not emissive
)

EMITTER = _record(  # an instance with emissive triangles
    "instance",
    "group",
    ("probability", 1),  # among emitters
)

LIGHT_TABLE = _record(
    "entries",  # int64, addresses of code by kind of light: kernels.lights.entries
    "n_local",  # lights 0 … n_local have a place, the others are suns
    "n_targets",
    "targets",  # float64 [n_targets, 5]: bounding sphere (centre, radius²) and index of the lamps that rays may find
    "n_emitters",
    "n_clusters",  # of lamps, chosen among before their lamps; 0: lamps are few
    "clusters",  # float64 [n_clusters, 7]: centre, radius (-1: suns), importance, first lamp, last lamp + 1
    "cluster_of",  # int32 [n_lights]
    "emitter_alias",  # ALIAS [n_emitters]
    "emitters",  # EMITTER [n_emitters]
    "groups",  # EMITTER_GROUP
    ("lamps", 1),  # probability of choosing a lamp, an emissive triangle, the world; sum 1, or all 0
    ("triangles", 1),
    ("world", 1),
    "places",  # int64, addresses of code that places points of lights: kernels.lights.points; 0: no reuse of points
    "tiles",  # LIGHT_TILES from which light samples are resampled; 0: they are drawn for their receiver
)

# A point of a light as reservoirs and tiles keep it: (source, primitive, u, v), see kernels.lights.points. `primitive`
# is that of the instance `source`, or one of:
POINT_ON_LAMP, POINT_ON_WORLD, POINT_NOWHERE = -1, -2, -3

TILE_ENTRY = np.dtype(  # such a point; how it shines stands in the groups of kernels.lights.shine
    [
        ("source", np.int32),
        ("primitive", np.int32),
        ("u", np.float32),
        ("v", np.float32),
        ("pdf", np.float32),  # in the measure of points; 0: empty
        ("size", np.float32),  # twice the area of a triangle that emits evenly: `p` and `shine` tell all; else 0
        ("p", np.float64, (3,)),  # on such a triangle
    ]
)

LIGHT_TILES = _record(
    "entries",  # TILE_ENTRY [n_tiles, groups, shine.LANES]
    "shines",  # float32 [n_tiles, groups, shine.FIELDS, shine.LANES]
    "n_tiles",
    "groups",  # of points in a tile
    "candidates",  # for each light sample
    "lamp_cdf",  # float64 [n_lights + 1], cumulated probabilities among lamps
    "code",  # of kernels.lights.tiles.sample_tiles
)

WORLD_TABLE = _record(
    "width",  # of the map; 0: directions are chosen uniformly
    "height",
    "marginal",  # float32 [height + 1], cumulated over rows, bottom to top
    "conditional",  # float32 [height, width + 1], cumulated over each row
    "guide",  # uint16 [height, width]: where in its row to start looking for i / width
    "max_bounces",
    "no_shadow",
    ("map", 1),  # probability of choosing the map, the sun's cone, the uniform sphere; sum 1
    ("sun", 1),
    ("uniform", 1),
    ("sun_direction", 3),
    ("sun_one_minus_cos", 1),
)

CAMERA = _record(
    "kind",  # CAMERA_*
    "width",  # of the whole frame, whatever part of it the film shows
    "height",
    "blades",
    ("to_world", 12),  # the camera looks along -z, y up
    ("to_camera", 12),
    "region_x",  # where the film begins in the whole frame, pixels from the lower left corner
    "region_y",
    ("screen", 4),  # left, right, bottom, top of the image plane at distance 1 (perspective) or in units
    ("clip_start", 1),
    ("clip_end", 1),
    ("aperture", 1),  # lens radius, 0: pinhole
    ("focus_distance", 1),
    ("blade_rotation", 1),
    ("aperture_ratio", 1),
    ("panorama", 4),  # longitude and latitude: minimum and maximum
)
CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA = 0, 1, 2

SCENE = _record(
    "embree",  # RTCScene, top level
    "meshes",
    "n_meshes",
    "instances",
    "n_instances",
    "materials",
    "n_materials",
    "material_slots",  # int32, indices into materials
    "code",  # int32, all programs
    "constants",  # float64
    "tables",  # float32: colour ramps, curves
    "images",
    "n_images",
    "shader_entries",  # int64: addresses of what runs programs, see kernels.shading.interpreter
    "texture_entries",  # int64: addresses of texture instructions by opcode, see kernels.shading.textures.dispatch
    "lobe_tables",  # float32: albedo tables, see kernels.lobes
    "lights",
    "n_lights",
    "light_table",  # owned by scene.lights: everything that selection and sampling need (its own record)
    "world_material",  # program of the world, -1: black
    "world_table",  # owned by scene.world: importance map
    "world_visibility",
    "camera",  # CAMERA, for nodes that read camera coordinates
    "flags",
    ("bounds", 6),  # min and max of all instances
)
SCENE_HAS_TRANSPARENT = 1
SCENE_HAS_SUBSURFACE = 2
SCENE_HAS_MEDIA = 4

# A render in progress ---------------------------------------------------------------------------------------

FILM = _record(
    "pixels",  # float32 [height, width, channels], rows bottom to top; sums over samples
    "width",
    "height",
    "channels",
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
    # Bits for the integrator: whether any pass of a kind is wanted.
    "light_passes",
    "data_passes",
)

INTEGRATOR = _record(
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
    "filter_table",  # float32 [FILTER_TABLE_SIZE], see settings.filter_table
    ("clamp_direct", 1),  # inf: off
    ("clamp_indirect", 1),
    ("filter_glossy", 1),  # inf: off
    ("pass_alpha_threshold", 1),
    "after_diffuse",  # RAY_NO_REFLECTION, …, RAY_BURLEY_DIFFUSE: what is off after a diffuse bounce
    "scatter",  # int64: code of subsurface scattering and what it needs, see kernels.subsurface.method_table
    "max_scatters",  # scattering events that a random walk may have, with one more it ends unseen; -1: Cycles' 255
    "media",  # int64 [5]: code for media that paths cross; see kernels.volume.calls
    "camera_in_media",  # 1: camera rays may start inside a medium
)
FILTER_TABLE_SIZE = 1025

PATH = _record(
    "pixel",  # address of the pixel's floats in the film
    "key",  # of the random numbers
    "guess",  # address of what kernels.lights.mean_visibility keeps of the pixel; 0: nothing
    "sample",
    "flags",  # RAY_* bits of the current ray
    "bounce",
    "diffuse_bounce",
    "glossy_bounce",
    "transmission_bounce",
    "transparent_bounce",
    "volume_bounce",
    "boundaries",  # invisible boundaries of media that were passed
    "event",  # what became of the path in a medium, see kernels.volume.calls
    "dimension",  # first random dimension of the current vertex
    "background_visible",  # nothing but transparency so far: alpha and data passes are still written
    "data_done",
    "denoise",  # denoising features are still to be written
    "last",  # no more lobes: only emission and transparency
    "scattered",  # whether subsurface.methods found where light leaves: LEAVES or LIT of path.state, else 0
    "scatter_pass",  # offset of the pass of the first subsurface scattering, -2: nobody wants it; -1: none so far
    ("o", 3),
    ("d", 3),
    ("tmin", 1),
    ("t", 1),  # where the ray ends, for the code of media
    ("medium_start", 1),  # where on the ray the present medium begins, while tmin > 0
    ("throughput", 3),
    ("diffuse_weight", 3),  # share of each class of lobes at the first bounce, for the light passes
    ("glossy_weight", 3),
    ("feature_throughput", 3),
    ("mis_pdf", 1),  # solid-angle pdf of d at o; 0: not found by light sampling, counts fully
    ("receiver", 3),  # light sampling's normal at o, see SHADING_POINT
    ("min_pdf", 1),
    ("dp", 1),
    ("dd", 1),
)

# Media that contain a point -----------------------------------------------------------------------------------------

MAX_MEDIA = 8
MAX_PHASES = 6
PHASE = 5  # float64 words of a phase function: kind (PHASE_* of kernels.volume.phase), weight, three parameters

MEDIUM = _record(
    "instance",
    "material",
    "priority",
    "n_phases",
    ("sigma_t", 3),  # extinction and scattering, 1 by scene unit
    ("sigma_s", 3),
    ("emission", 3),  # radiance by scene unit
    ("phases", MAX_PHASES * PHASE),
)

MEDIA = _record(  # followed by MEDIUM [MAX_MEDIA]
    "count",
    "top",  # highest priority of the media; those that have it add up to:
    ("sigma_t", 3),
    ("sigma_s", 3),
    ("emission", 3),
)

SHADOW = _record(  # a shadow ray through media
    ("o", 3),
    ("d", 3),
    ("tmax", 1),
    ("transmittance", 3),
)

mesh_at = record_at(MESH)
instance_at = record_at(INSTANCE)
attribute_at = record_at(ATTRIBUTE)
material_at = record_at(MATERIAL)
image_at = record_at(IMAGE)
closure_at = record_at(CLOSURE)
shading_point_at = record_at(SHADING_POINT)
light_at = record_at(LIGHT)
light_sample_at = record_at(LIGHT_SAMPLE)
scene_at = record_at(SCENE)
light_table_at = record_at(LIGHT_TABLE)
light_tiles_at = record_at(LIGHT_TILES)
tile_entry_at = record_at(TILE_ENTRY)
emitter_at = record_at(EMITTER)
emitter_group_at = record_at(EMITTER_GROUP)
world_table_at = record_at(WORLD_TABLE)
path_at = record_at(PATH)
camera_at = record_at(CAMERA)
medium_at = record_at(MEDIUM)
media_at = record_at(MEDIA)
shadow_at = record_at(SHADOW)
integrator_at = record_at(INTEGRATOR)
film_at = record_at(FILM)

# Working memory of one tile call: one block, owned by the session, 64-byte aligned ---------------------------------

SCRATCH_RAY = 0  # RTCRayHit, 96 bytes, and a second one for shadow rays behind it
SCRATCH_SHADOW_RAY = 128
SCRATCH_LIGHT_SAMPLE = 256
SCRATCH_POINT = 512  # SHADING_POINT of the path
SCRATCH_PATH = 1280  # PATH
SCRATCH_SHADOW_POINT = 2048  # SHADING_POINT of transparent shadows and of lights' programs
SCRATCH_CLOSURES = 4096
SCRATCH_SHADOW_CLOSURES = SCRATCH_CLOSURES + MAX_CLOSURES * CLOSURE.itemsize
SCRATCH_REGISTERS = SCRATCH_SHADOW_CLOSURES + MAX_CLOSURES * CLOSURE.itemsize
SCRATCH_SHADOW_REGISTERS = SCRATCH_REGISTERS + 8 * MAX_REGISTERS
SCRATCH_SCATTER = SCRATCH_SHADOW_REGISTERS + 8 * MAX_REGISTERS  # what subsurface scattering keeps
SCRATCH_MEDIA = SCRATCH_SCATTER + 32768  # MEDIA of the path's point, and of the shadow ray's
SCRATCH_SHADOW_MEDIA = SCRATCH_MEDIA + MEDIA.itemsize + MAX_MEDIA * MEDIUM.itemsize
SCRATCH_SHADOW = SCRATCH_SHADOW_MEDIA + MEDIA.itemsize + MAX_MEDIA * MEDIUM.itemsize
SCRATCH_SHINE = SCRATCH_SHADOW + 256  # of a group of points of light tiles
SCRATCH_BYTES = SCRATCH_SHINE + 1024
