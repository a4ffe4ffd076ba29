"""Passes of light groups: lamps send out red light, meshes and media green, the world blue, and no channels mix.

So the pass of each group has its channel of Combined and nothing else, to rounding, whatever way light has taken.
"""

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.lamps import area_lamp, point_lamp, sun_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.world import World
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes import media, rooms, scattering
from testing.scenes.lights import emission_program, matrix
from testing.scenes.shapes import ball

GROUPS = ("lamps", "meshes", "world")


def stage() -> rooms.Builder:
    """The room under red lamps and a blue world."""
    b = rooms.room()
    b.lamp(area_lamp(rooms.ABOVE, (40.0, 0.0, 0.0), 1.2, 0.8))
    b.lamp(point_lamp(matrix((-1.2, -0.8, 1.0)), (30.0, 0.0, 0.0), 0.25))
    b.lamp(point_lamp(matrix((0.2, -1.0, 1.2)), (20.0, 0.0, 0.0), 0.0))
    b.lamp(sun_lamp(rooms.BESIDE, (0.5, 0.0, 0.0), 0.1))
    material = b.scene.shaders.add(rooms.checkered((0.0, 0.0, 0.6), (0.0, 0.0, 0.05), 1.7))
    b.scene.world = World(material=material, map_width=64, light_group=2)
    return b


def finish(b: rooms.Builder, emitting: int):
    """The scene with its green meshes, committed; so many objects before these emit as well."""
    b.add(
        rooms.QUAD, rooms.checkered((0.0, 6.0, 0.0), (0.0, 30.0, 0.0), 7.0), rooms.scaled(rooms.BESIDE, 0.25, 0.25, 1)
    )
    b.add(rooms.CUBE, emission_program((0.0, 9.0, 0.0)), rooms.scaled(matrix((0.9, 0.5, 0.3)), 0.1, 0.1, 0.1))
    description = b.describe(rooms.look((0.4, -3.2, 1.9), (0.0, 0.0, 0.45), 16))
    description.light_groups = {name: number for number, name in enumerate(GROUPS)}
    for lamp in description.lights.lamps:
        lamp["light_group"] = 0
    description.instances["light_group"][-2 - emitting :] = 1
    return description.commit()


def medium_scene():
    b = stage()
    glow = media.medium(0.5, (0.8, 0.6, 0.4), (0.0, 0.3, 0.0), 0.4)
    b.add(rooms.CUBE, glow, rooms.scaled(matrix((0.3, -0.6, 0.5)), 0.4, 0.4, 0.4))
    return finish(b, 1)


def skin_scene():
    b = stage()
    program = scattering.subsurface_program((0.8, 0.5, 0.4), (0.4, 0.2, 0.1))
    b.add(Mesh(*ball(1.0, 24)), program, rooms.scaled(matrix((0.2, -0.7, 0.5)), 0.5, 0.5, 0.5))
    return finish(b, 0)


SCENES = {"room": lambda: finish(stage(), 0), "medium": medium_scene, "skin": skin_scene}
SPATIAL = {"pilot": False, "rounds": 1}
WAYS = {
    "PATH": ("room medium skin", {}),
    "clamped": ("room", {"clamp_direct": 0.5, "clamp_indirect": 0.1}),
    "HYBRID": ("skin", {"sss_method": "HYBRID"}),
    "RESTIR": ("room medium", {"reuse": ReuseSettings(pilot=False), "clamp_direct": 0.5}),
    "in time": ("room", {"reuse": ReuseSettings(temporal=True, **SPATIAL)}),
    "by channel": ("room", {"reuse": ReuseSettings(by_channel=True, **SPATIAL)}),
    "whole": ("room", {"reuse": ReuseSettings(paths="WHOLE", temporal=True, **SPATIAL)}),
    "indirect": ("room", {"reuse": ReuseSettings(paths="INDIRECT", **SPATIAL)}),
    "below": ("skin", {"reuse": ReuseSettings(pilot=False), "sss_method": "HYBRID", "sss_shift": "RECONNECTION"}),
    "blocks": ("skin", {"reuse": ReuseSettings(pilot=False), "sss_method": "DIFFUSION", "sss_shift": "BLOCKS"}),
    "crossing": (
        "skin",
        {"reuse": ReuseSettings(pilot=False), "sss_method": "HYBRID", "sss_refraction": "TEMPORAL"},
    ),
}


@pytest.mark.parametrize(("name", "way"), [(name, way) for way in WAYS for name in WAYS[way][0].split()])
def test_the_light_of_each_group_is_its_channel_of_the_picture(name, way):
    options = WAYS[way][1]
    integrator = "RESTIR" if "reuse" in options else "PATH"
    settings = RenderSettings(integrator, 4, max_bounces=5, volume_bounces=5, light_groups=GROUPS, **options)
    session = Session(SCENES[name](), settings)
    session.render()
    combined = session.film.sums("Combined")[..., :3]
    assert (combined.mean((0, 1)) > 0.05).all()
    for channel, group in enumerate(GROUPS):
        light = session.film.sums(f"Combined_{group}")
        np.testing.assert_allclose(light[..., channel], combined[..., channel], rtol=1e-5, atol=1e-4, err_msg=group)
        assert not np.delete(light, channel, axis=2).any(), group


def test_what_no_group_has_is_in_no_pass_and_other_films_have_none():
    scene = SCENES["room"]()
    assert (scene.light_groups["count"] == len(GROUPS)).all()
    session = Session(scene, RenderSettings(samples=1))
    session.render()
    assert session.film.record["light_groups"] == 0 and session.film.record["groups"] == -1
    assert rec.LIGHT_GROUPS.itemsize == scene.light_groups.nbytes
