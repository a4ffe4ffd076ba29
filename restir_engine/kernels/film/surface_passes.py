"""Passes that describe the first surface: data, colours of lobes, the denoiser's features."""

from ..core.jit import device
from ..core.memory import store_f32
from ..core.records import instance_at, material_at
from ..core.vec import average, dot, length, mul, put, transform_point, vec
from ..geometry.attributes import attribute
from ..lobes import bsdf_color, bsdf_normal, denoise_features
from .contribute import add3, set3


@device
def data_passes(scene, camera, integrator, film, path, sp):
    """Passes that describe the first surface: those of the first sample, averages, and lobes' colours."""
    pixel = path.pixel
    p = vec(sp.p)
    if path.data_done == 0:
        if path.sample == 0:
            if film.depth >= 0:
                store_f32(pixel, film.depth, camera_depth(camera, p))
            if film.object_index >= 0:
                store_f32(pixel, film.object_index, float(instance_at(scene.instances, sp.instance).object_index))
            if film.material_index >= 0:
                store_f32(pixel, film.material_index, float(material_at(scene.materials, sp.material).pass_index))
            set3(pixel, film.position, p)
        if average(vec(sp.transparent)) <= 1.0 - integrator.pass_alpha_threshold:
            add3(pixel, film.normal, bsdf_normal(sp))
            if film.uv >= 0:
                found, x, y, _z, _w = attribute(scene, sp, 0, 0.0, 0.0)
                if found:
                    add3(pixel, film.uv, (x, y, 1.0))
            path.data_done = 1
    if film.diffuse_color >= 0 or film.glossy_color >= 0 or film.transmission_color >= 0:
        c = bsdf_color(scene, sp)
        t = vec(path.throughput)
        add3(pixel, film.diffuse_color, mul(t, (c[0], c[1], c[2])))
        add3(pixel, film.glossy_color, mul(t, (c[3], c[4], c[5])))
        add3(pixel, film.transmission_color, mul(t, (c[6], c[7], c[8])))


@device
def camera_depth(camera, p):
    """Distance along the view axis; for a panorama from the camera's centre."""
    q = transform_point(camera.to_camera, p)
    return length(q) if camera.kind == 2 else -q[2]


@device
def feature_passes(scene, camera, film, path, sp):
    """The denoiser's albedo and normal, behind mirrors and glass those of what is seen in them."""
    albedo, normal, specular, diffuse_like = denoise_features(scene, sp)
    t = vec(path.feature_throughput)
    if diffuse_like:
        add3(path.pixel, film.denoising_albedo, mul(t, albedo))
        n = (
            dot((camera.to_camera[0], camera.to_camera[1], camera.to_camera[2]), normal),
            dot((camera.to_camera[4], camera.to_camera[5], camera.to_camera[6]), normal),
            dot((camera.to_camera[8], camera.to_camera[9], camera.to_camera[10]), normal),
        )
        add3(path.pixel, film.denoising_normal, n)
        path.denoise = 0
    else:
        put(path.feature_throughput, mul(t, specular))
