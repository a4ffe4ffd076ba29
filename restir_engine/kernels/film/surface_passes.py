"""Passes that describe the first surface, or the first medium: data, colours of lobes, the denoiser's features."""

from ..core.jit import device, inlined
from ..core.memory import call_entry, record_address, store_f32
from ..core.records import CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA, camera_at, instance_at, material_at
from ..core.vec import average, is_black, length, mul, put, scale, store3_f32, transform_point, transform_vector, vec
from ..geometry.attributes import attribute
from ..lobes import bsdf_color, bsdf_normal, denoise_features, graded_features
from ..shading.interpreter import write_aovs
from .contribute import add1, add3
from .cryptomatte import add_to_slots
from .vectors import add_vector


@inlined
def surface_passes(scene, integrator, film, scratch, path, sp):
    """Describe the surface at sp, if the path is the first to see one, as the camera does in the shutter's middle."""
    camera = camera_at(scene.camera, 0)
    if film.data_passes > 0 and path.background_visible > 0:
        _data_passes(scene, camera, integrator, film, path, sp)
        if film.more_data != 0:
            records = record_address(scene), record_address(integrator), record_address(film)
            call_entry(film.more_data, records[0], records[1], records[2], scratch, 0)
    if film.denoising_albedo >= 0 and path.denoise > 0:
        _feature_passes(scene, camera, integrator, film, path, sp)


@inlined
def wants_aovs(film, path):
    """Whether AOVs are asked for of what the path sees next."""
    return film.aovs >= 0 and path.background_visible > 0 and path.data_done == 0


@inlined
def aov_passes(scene, film, path, sp):
    """Add what AOV Output nodes say at sp, where the path is the first to be there; before sp is shaded.

    As in Cycles every surface that is seen adds all of its value, also one that a transparent one lies before.
    """
    if wants_aovs(film, path):
        write_aovs(scene, sp, path.pixel + 4 * film.aovs)


@inlined
def medium_passes(film, path, albedo):
    """Describe a medium that the path scatters in, by its albedo, if nothing else has been."""
    if film.denoising_albedo >= 0 and path.denoise > 0:
        add3(path.pixel, film.denoising_albedo, mul(vec(path.feature_throughput), albedo))
        path.denoise = 0


@device
def _data_passes(scene, camera, integrator, film, path, sp):
    """Those of the first sample, averages, and lobes' colours."""
    pixel = path.pixel
    p = vec(sp.p)
    if path.data_done == 0:
        if path.sample == 0:
            if film.depth >= 0:
                store_f32(pixel, film.depth, _camera_depth(camera, p))
            if film.object_index >= 0:
                store_f32(pixel, film.object_index, float(instance_at(scene.instances, sp.instance).object_index))
            if film.material_index >= 0:
                store_f32(pixel, film.material_index, float(material_at(scene.materials, sp.material).pass_index))
            if film.position >= 0:
                store3_f32(pixel + 4 * film.position, 0, p)
        if average(vec(sp.transparent)) <= 1.0 - integrator.pass_alpha_threshold:
            add3(pixel, film.normal, bsdf_normal(sp))
            if film.uv >= 0:
                found, x, y, _z, _w = attribute(scene, sp, 0, 0.0, 0.0)
                if found:
                    add3(pixel, film.uv, (x, y, 1.0))
            add_vector(scene, film, path, record_address(sp))
            path.data_done = 1
    if film.diffuse_color >= 0 or film.glossy_color >= 0 or film.transmission_color >= 0:
        c = bsdf_color(scene, sp)
        t = vec(path.throughput)
        add3(pixel, film.diffuse_color, mul(t, c.diffuse))
        add3(pixel, film.glossy_color, mul(t, c.glossy))
        add3(pixel, film.transmission_color, mul(t, c.transmission))
    if film.mist >= 0:
        add1(pixel, film.mist, _clear_air(camera, integrator, p) * average(mul(vec(path.throughput), _opacity(sp))))
    if film.crypto_slots > 0:
        _mattes(scene, film, path, sp)


@inlined
def _opacity(sp):
    """What the surface at sp does not let through straight."""
    t = vec(sp.transparent)
    return 1.0 - t[0], 1.0 - t[1], 1.0 - t[2]


@device
def _mattes(scene, film, path, sp):
    """Add what the surface covers of the pixel to the slots of its object, material and asset."""
    weight = average(vec(path.throughput)) * average(_opacity(sp))
    instance = instance_at(scene.instances, sp.instance)
    for offset, identity in (
        (film.crypto_object, instance.crypto_object),
        (film.crypto_material, material_at(scene.materials, sp.material).crypto_material),
        (film.crypto_asset, instance.crypto_asset),
    ):
        if offset >= 0:
            add_to_slots(path.pixel + 4 * offset, film.crypto_slots, identity, weight)


@device
def _clear_air(camera, integrator, p):
    """1 less the mist between the camera and p, which is as thick as the distance makes it."""
    q = transform_point(camera.to_camera, p)
    distance = -q[2] if camera.kind == CAMERA_ORTHOGRAPHIC else length(q)
    mist = (distance - integrator.mist_start) * integrator.mist_density
    return 1.0 - min(max(mist, 0.0), 1.0) ** integrator.mist_power


@device
def _camera_depth(camera, p):
    """Distance along the view axis; for a panorama from the camera's centre."""
    q = transform_point(camera.to_camera, p)
    return length(q) if camera.kind == CAMERA_PANORAMA else -q[2]


@device
def _feature_passes(scene, camera, integrator, film, path, sp):
    """The denoiser's albedo and normal, behind mirrors and glass those of what is seen in them."""
    t = vec(path.feature_throughput)
    weight = average(t)
    if film.denoising_depth >= 0:
        add1(path.pixel, film.denoising_depth, weight * (sp.t - path.tmin))
    if integrator.graded_features != 0:
        albedo, normal, specular, onward, roughness = graded_features(scene, sp)
        normal = scale(normal, weight)
        if path.bounce == 0 and film.denoising_roughness >= 0:
            add1(path.pixel, film.denoising_roughness, weight * roughness)
            add3(path.pixel, film.denoising_specular, mul(t, specular))
    else:
        albedo, normal, onward, diffuse_like = denoise_features(scene, sp)
        if diffuse_like:
            onward = (0.0, 0.0, 0.0)
        else:
            albedo = normal = (0.0, 0.0, 0.0)
    add3(path.pixel, film.denoising_albedo, mul(t, albedo))
    n = transform_vector(camera.to_camera, normal)
    add3(path.pixel, film.denoising_normal, (n[0], n[1], -n[2]))  # z along the view, as in Cycles
    put(path.feature_throughput, mul(t, onward))
    if is_black(onward):
        path.denoise = 0
