"""Lamps, emissive triangles, the world, and a sample of their light."""

import numpy as np

from ..memory import record_at
from .layout import record

LIGHT_POINT, LIGHT_SPOT, LIGHT_AREA, LIGHT_SUN = 0, 1, 2, 3

LIGHT = record(
    "kind",  # LIGHT_POINT …
    "material",  # program, -1: constant emission of 1
    "seen_by",  # RAY_* bits of the rays that see its light, by what they are at the point that is lit
    "links",  # the light sets that it reaches, a bit each: kernels.lights.linking
    "blockers",  # the sets of instances that block it, likewise
    "flags",  # LIGHT_* bits
    "object_index",
    "light_group",  # see LIGHT_GROUPS
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
light_at = record_at(LIGHT)
LIGHT_HITTABLE = 1  # rays find it, the camera's too
LIGHT_NO_SHADOW = 2
LIGHT_SPHERE = 4  # point and spot: a sphere; else a disk that turns towards the point that is lit
LIGHT_ELLIPSE = 8  # area: elliptic
LIGHT_DELTA = 16  # no size: next event estimation alone finds it
LIGHT_IN_MEDIUM = 32  # a point or spot within the bounds of an instance that has a medium inside

LIGHT_GROUPS = record(  # what belongs to which light group of the view layer, by its number; -1: to none
    "count",
    "lights",  # LIGHT [n_lights]
    "instances",  # INSTANCE [n_instances]
    "world",
    "world_medium",  # what the world's medium emits
)
light_groups_at = record_at(LIGHT_GROUPS)

LIGHT_SAMPLE = record(
    "light",  # light index, -1: emissive triangle, -2: world
    "flags",
    "seen_by",  # RAY_DIFFUSE, RAY_GLOSSY, RAY_TRANSMIT: the parts of the BSDF that this light reaches
    "blockers",  # see LIGHT
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
    ("control_variate", 3),  # of mean 0, to be added times the mean V: all candidates of a tile less the chosen one
)
light_sample_at = record_at(LIGHT_SAMPLE)
LIGHT_SAMPLE_DELTA = 1  # next event estimation alone finds it: a light without size or MIS, or with blockers of its own
LIGHT_SAMPLE_NO_SHADOW = 2

# A pair of an alias table: bin i is chosen below `threshold`, else `alias`.
ALIAS = np.dtype([("threshold", np.float32), ("alias", np.int32)])

EMITTER_GROUP = record(  # the emissive triangles of one mesh under one list of materials
    "n",
    "alias",  # ALIAS [n]
    "primitives",  # int32 [n], so that what is near in the list is near in space
    "cells",  # along an edge of each triangle, see kernels.lights.cells; 1: triangles are not divided
    "cumulated",  # float64 [n cells² + 1], cumulated weights of cells in that order
    "positions",  # int32 [n_triangles of the mesh], where in that list, -1: not emissive
    "probabilities",  # float32 [n_triangles of the mesh], 0: not emissive
)
emitter_group_at = record_at(EMITTER_GROUP)

EMITTER = record(  # an instance with emissive triangles
    "instance",
    "group",
    "first_leaf",  # of its leaves in the tree
    ("probability", 1),  # among emitters
    ("reach", 1),  # how far from its place in the middle of the shutter it may be at another time
)
emitter_at = record_at(EMITTER)

EMITTER_TREE = record(  # see kernels.lights.emitter_tree
    "width",  # places of leaves, a power of two
    "top",  # nodes top … 2 top are weighed at once
    "run",  # triangles of a leaf
    "nodes",  # float32 [2 width, NODE]
    "leaves",  # int32 [width, 2]: emitter and which run of its group
    "places",  # int32 [leaves in the order of the emitters]: where each stands
)
emitter_tree_at = record_at(EMITTER_TREE)

LIGHT_TABLE = record(
    "entries",  # int64, addresses of code by kind of light: kernels.lights.entries
    "n_local",  # lights 0 … n_local have a place, the others are suns
    "targets_width",  # leaves of the tree over lamps that rays may find, a power of two; 0: there are none
    "targets",  # float64 [2 width, 5], a heap with the root 1: bounding sphere (centre, radius²), index of the lamp
    "n_emitters",
    "n_clusters",  # of lamps, chosen among before their lamps; 0: lamps are few
    "clusters",  # float64 [n_clusters, 7]: centre, radius (-1: suns), importance, first lamp, last lamp + 1
    "cluster_of",  # int32 [n_lights]
    "emitter_alias",  # ALIAS [n_emitters]
    "emitters",  # EMITTER [n_emitters]
    "groups",  # EMITTER_GROUP
    "emitter_tree",  # EMITTER_TREE; 0: nothing emits
    ("lamps", 1),  # probability of choosing a lamp, an emissive triangle, the world; sum 1, or all 0
    ("triangles", 1),
    ("world", 1),
    "tiles",  # a frame's LIGHT_TILES, from which light samples are resampled; 0: they are drawn for their receiver
)
light_table_at = record_at(LIGHT_TABLE)

# A point of a light as reservoirs and tiles keep it: (source, primitive, u, v), see kernels.lights.points. `primitive`
# is that of the instance `source`, or one of:
POINT_ON_LAMP, POINT_ON_WORLD, POINT_NOWHERE = -1, -2, -3

TILE_ENTRY = np.dtype(  # such a point; how it shines stands in the groups of kernels.lights.tile_weights
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
tile_entry_at = record_at(TILE_ENTRY)

LIGHT_TILES = record(
    "entries",  # TILE_ENTRY [n_tiles, groups, tile_weights.LANES]
    "emission",  # float32 [n_tiles, groups, tile_weights.FIELDS, tile_weights.LANES]
    "n_tiles",
    "groups",  # of points in a tile
    "candidates",  # for each light sample
    "control_variates",  # 1: light samples have one
    ("apart", 1),  # probability that a light sample is not of a tile, but of the world, drawn for its receiver
    "lamp_cdf",  # float64 [n_lights + 1], cumulated probabilities among lamps
    "code",  # of kernels.lights.tiles.sample_tiles
)
light_tiles_at = record_at(LIGHT_TILES)

WORLD_TABLE = record(
    "width",  # of the map
    "height",
    "marginal",  # float32 [height + 1], cumulated over rows, bottom to top
    "conditional",  # float32 [height, width + 1], cumulated over each row
    "guide",  # uint16 [height, width]: where in its row to start looking for i / width
    "max_bounces",
    "no_shadow",
    ("map", 1),  # probability of choosing the map, the sun's cone; sum 1
    ("sun", 1),
    ("sun_direction", 3),
    ("sun_one_minus_cos", 1),
    ("irradiance", 9),  # as a polynomial of the normal, see lights.choice.world_brings
    "n_portals",
    "portals",  # LIGHT [n_portals], area lamps; see kernels.lights.portals
    ("portal", 1),  # probability of choosing a portal where any faces the point, the rest is for map and sun
)
world_table_at = record_at(WORLD_TABLE)
