"""What an object says about itself whatever its type: which rays see it, random number, custom properties."""

from functools import cache

import numpy as np

from ..kernels.core.records import (
    INSTANCE_HOLDOUT,
    INSTANCE_SHADOW_CATCHER,
    RAY_CAMERA,
    RAY_DIFFUSE,
    RAY_GLOSSY,
    RAY_SHADOW,
    RAY_TRANSMIT,
    RAY_VOLUME,
)
from .hashing import hash_string, hash_uint2, to_unit
from .mesh import read_values

RAY_VISIBILITY = {
    "visible_camera": RAY_CAMERA,
    "visible_diffuse": RAY_DIFFUSE,
    "visible_glossy": RAY_GLOSSY,
    "visible_transmission": RAY_TRANSMIT,
    "visible_volume_scatter": RAY_VOLUME,
    "visible_shadow": RAY_SHADOW,
}


def rays_that_see(instance, view_layer) -> int:
    """RAY_* bits of the rays that see an entry of `depsgraph.object_instances`: what it and its instancer allow."""
    owner = instance.instance_object if instance.is_instance else instance.object
    seen_by = _flags(owner or instance.object)
    parent = instance.parent
    if parent is not None and parent != owner:
        seen_by &= _flags(parent)
    view = placed_by(instance).original  # the view layer knows originals alone
    if view.indirect_only_get(view_layer=view_layer) and not view.holdout_get(view_layer=view_layer):
        seen_by &= ~RAY_CAMERA
    return seen_by


def placed_by(instance):
    """The object of the view layer that an entry of `depsgraph.object_instances` is there by: its outermost instancer.

    What the view layer says of a collection, Holdout and Indirect Only, goes by it and not by what is instanced.
    """
    return instance.parent if instance.is_instance and instance.parent is not None else instance.object


def _flags(owner) -> int:
    return sum(bits for name, bits in RAY_VISIBILITY.items() if getattr(owner, name))


def instance_flags(instance, view_layer) -> int:
    """INSTANCE_HOLDOUT and INSTANCE_SHADOW_CATCHER; the former goes by the instancer, the latter by either."""
    instancer = placed_by(instance)
    flags = INSTANCE_HOLDOUT if instancer.original.holdout_get(view_layer=view_layer) else 0
    catches = instance.object.is_shadow_catcher or instancer.is_shadow_catcher
    return flags | (INSTANCE_SHADOW_CATCHER if catches else 0)


def light_group(scene, instance) -> int:
    """The number of the light group of an entry of `depsgraph.object_instances`, -1: none.

    That which its object names, or else its instancer; the view layer may not have it.
    """
    name = instance.object.lightgroup or (instance.parent.lightgroup if instance.parent else "")
    return scene.light_groups.get(name, -1)


def asset_name(item) -> str:
    """What Cryptomatte takes for the asset that an object is part of: its topmost parent."""
    while item.parent is not None:
        item = item.parent
    return item.name


@cache
def name_random(name: str) -> float:
    """Object Info > Random of an object that is no instance."""
    return float(to_unit(hash_uint2(hash_string(name), 0)))


def property_value(kind: str, name: str, instance, scene, view_layer) -> tuple[float, float, float, float] | None:
    """The value of an Attribute node of type OBJECT, INSTANCER or VIEW_LAYER; None when nothing has such a property."""
    if kind == "VIEW_LAYER":
        owners = [view_layer, scene, scene.world]
    else:
        owners = [instance.object, instance.object.data]
        if kind == "INSTANCER" and instance.parent is not None:
            owners = [instance.parent, instance.parent.data, *owners]
    for owner in owners:
        value = None if owner is None else _lookup(owner, name)
        if value is not None:
            return value
    return None


def instancer_values(instancer, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """An attribute that geometry nodes have stored with the instances of an object: (values, numbers of the instances).

    The numbers, which `persistent_id` ends with, grow; None where there is no such attribute.
    """
    geometry = instancer.evaluated_geometry()  # owns the points
    points = geometry.instances_pointcloud()
    attribute = points.attributes.get(name) if points else None
    values = None if attribute is None else read_values(attribute)
    if values is None or not len(values):
        return None
    numbers = points.attributes.get("id")
    numbers = np.arange(len(values)) if numbers is None else read_values(numbers)[:, 0]
    order = np.argsort(numbers, kind="stable")
    return values[order], numbers[order]


def _lookup(owner, name: str) -> tuple[float, float, float, float] | None:
    value = owner.get(name)
    if value is None:
        try:
            value = owner.path_resolve(name)
        except ValueError:
            return None
    if isinstance(value, (bool, int, float)):
        return _four([float(value)])
    try:
        numbers = [float(x) for x in value]
    except (TypeError, ValueError):
        return None
    if not 1 <= len(numbers) <= 4:
        return None
    return _four(numbers)


def _four(numbers: list[float]) -> tuple[float, float, float, float]:
    """What an Attribute node makes of 1 to 4 numbers: one of them goes to all channels."""
    if len(numbers) == 1:
        return numbers[0], numbers[0], numbers[0], 1.0
    return tuple(numbers + [0.0, 0.0, 0.0, 1.0][len(numbers) :])
