"""Meshes, strands and spheres, their instances, and what is interpolated over them."""

from ..memory import record_at
from .layout import record

# What a MESH is made of: triangles; spheres; segments of strands: ribbons that are flat across the ray, tubes that are
# round, both along Catmull-Rom curves, and cones between spheres. The ID of their geometry in Embree's scenes.
SHAPE_TRIANGLES, SHAPE_SPHERES, SHAPE_RIBBONS, SHAPE_TUBES, SHAPE_CONES = 0, 1, 2, 3, 4
SHAPE_STRANDS = SHAPE_RIBBONS  # from here on: strands

# Of the entries of a shape in SCENE.shape_entries: SHAPE_ENTRIES * shape + one of these.
SHAPE_ENTRIES = 3
SHAPE_HIT, SHAPE_SURFACE, SHAPE_CENTRE = 0, 1, 2

# Attribute domains; those of spheres are DOMAIN_POINT and DOMAIN_MESH, a strand is a DOMAIN_FACE.
DOMAIN_POINT, DOMAIN_CORNER, DOMAIN_FACE, DOMAIN_MESH, DOMAIN_VOXEL = 0, 1, 2, 3, 4

# Interned names with a meaning of their own; see scene.names.
ATTRIBUTE_UV, ATTRIBUTE_GENERATED = 0, 1

ATTRIBUTE = record(
    "name",  # interned, see Scene.attribute_names; 0 is the active render UV map
    "domain",
    "components",  # 1 to 4 floats an element
    "values",  # float32 [elements, components]; of DOMAIN_VOXEL a VOXELS record
)
attribute_at = record_at(ATTRIBUTE)

MESH = record(
    "shape",  # SHAPE_*; what triangles need is 0 for others
    "vertices",  # float32 [n_vertices, 3]
    "n_vertices",
    "triangles",  # uint32 [n_triangles, 3], vertex indices
    "n_triangles",
    "corners",  # uint32 [n_triangles, 3], indices into DOMAIN_CORNER arrays
    "polygons",  # int32 [n_triangles], indices into DOMAIN_FACE arrays
    "normals",  # float32 [points or corners, 3], object space; 0: flat
    "normals_domain",  # DOMAIN_POINT or DOMAIN_CORNER
    "smooth",  # uint8 [n_triangles], 0: this triangle is flat; address 0: all smooth when normals is set
    "material_slots",  # int32 [n_triangles, segments or spheres], slot of the object; address 0: all 0
    "attributes",  # ATTRIBUTE [n_attributes]
    "n_attributes",
    "embree",  # RTCScene of this mesh alone (bottom level)
    "points",  # float32 [n, 4], place and radius: of spheres; of strands, whose first and last points stand twice
    "segments",  # uint32 [n_segments], the first of four points: a segment leads from the second to the third
    "n_segments",
    "strands",  # int32 [n_segments], the strand that a segment belongs to
    "pieces",  # how many flat pieces a segment of a ribbon is made of
    # Of what changes its form while the shutter is open:
    "n_steps",  # at even distances of time; 0: it does not
    "steps",  # float32 [n_steps, steps_stride, 3], like `vertices`, or [n_steps, steps_stride, 4], like `points`
    "steps_stride",
    "normal_steps",  # float32 [n_steps, normals_stride, 3], like `normals`
    "normals_stride",
    ("generated_offset", 3),  # generated = (p - offset) * scale, in object space
    ("generated_scale", 3),
)
mesh_at = record_at(MESH)

INSTANCE = record(
    "mesh",  # index into meshes
    "materials",  # start in material_slots
    "n_materials",
    "seen_by",  # RAY_* bits of the rays that see it
    "flags",  # INSTANCE_* bits
    "object_index",  # pass_index of the object
    "light_group",  # that its emission belongs to, -1: none
    ("crypto_object", 1),  # ids, see scene.cryptomatte
    ("crypto_asset", 1),
    "key",  # the same in every frame of an animation, and nobody else's
    "light_set",  # that it belongs to, see kernels.lights.linking
    "blocker_set",
    "links",  # the sets that its emission reaches, a bit each
    "blockers",  # likewise, of sets of what blocks its emission
    "lights",  # start of this instance's triangles in the table of emissive triangles, -1: none
    "attributes",  # ATTRIBUTE [n_attributes] of this instance (DOMAIN_MESH): properties of the object
    "n_attributes",
    "majorants",  # int64 [n_materials]: MAJORANTS of the medium of each slot's material; 0: it does not vary
    ("volume_density", 1),  # factor of the coefficients of the medium inside
    ("random", 1),  # Object Info > Random
    ("color", 4),
    ("location", 3),
    ("to_world", 12),
    ("to_object", 12),
    ("dupli_generated", 3),  # the instancer's texture coordinates
    ("dupli_uv", 2),
    ("particle", 1),  # particle random, 0 when there is none
    ("terminator", 1),  # cosine below which shadow rays start above smooth triangles, see interaction.shadow_origin
    ("terminator_frequency", 1),  # above 1: by how much lobes' cosines fall faster, see lobes.closure.terminator_offset
    # Of what moves, whose matrices and location are those of the middle of the shutter; see kernels.geometry.placed:
    "n_steps",  # at even distances of time; 0: it stands still
    "steps",  # float32 [n_steps, 12], like `to_world`
)
instance_at = record_at(INSTANCE)
INSTANCE_MIRRORED = 1  # the matrix has a negative determinant
INSTANCE_HOLDOUT = 2
INSTANCE_SHADOW_CATCHER = 4
