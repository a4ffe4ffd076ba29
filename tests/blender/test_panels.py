"""Every panel draws, and every property that it shows exists; Blender's own panels show where they should."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]


class Layout:
    """Takes the place of UILayout: checks what is drawn and counts it."""

    def __init__(self) -> None:
        self.drawn: list[str] = []

    def column(self, **_options):
        return self

    row = column

    def prop(self, data, name: str, **_options) -> None:
        assert name in data.bl_rna.properties, f"{data!r} has no {name}"
        self.drawn.append(name)

    def label(self, text: str, **_options) -> None:
        self.drawn.append(text)

    def operator(self, name: str, **_options) -> SimpleNamespace:
        assert name.startswith(("restir.", "scene.view_layer_", "object.bake"))
        self.drawn.append(name)
        return SimpleNamespace()

    def operator_menu_enum(self, name: str, prop: str, **_options) -> None:
        self.drawn.append(prop)
        self.operator(name)

    def prop_search(self, data, name: str, search_data, search_name: str, **_options) -> None:
        assert search_name in search_data.bl_rna.properties
        self.prop(data, name)

    def menu(self, name: str, **_options) -> None:
        assert hasattr(bpy.types, name)

    def template_node_view(self, tree, node, socket) -> None:
        self.drawn.append(socket.name)

    def template_list(self, kind: str, _id: str, data, items: str, active_data, active: str, **_options) -> None:
        assert hasattr(bpy.types, kind)
        self.prop(data, items)
        self.prop(active_data, active)

    def template_curve_mapping(self, data, name: str, **_options) -> None:
        self.prop(data, name)

    def separator(self) -> None:
        pass


def draw(panel, **context) -> list[str]:
    """What a panel shows in a context of these members; [] where its poll refuses."""
    defaults = {"engine": "RESTIR", "scene": bpy.context.scene, "view_layer": bpy.context.view_layer}
    absent = {"object": None, "light": None, "camera": None, "material": None, "world": None}
    everything = SimpleNamespace(
        region=SimpleNamespace(width=300),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        **(absent | defaults | context),
    )
    bound = SimpleNamespace(layout=Layout())
    bound.column = lambda: bound.layout
    if not panel.poll(everything):
        return []
    if hasattr(panel, "draw_header"):
        panel.draw_header(bound, everything)
    panel.draw(bound, everything)
    return bound.layout.drawn


def owners() -> dict[str, dict]:
    """Contexts in which panels of each tab show, by what the tab is about."""
    lights = [bpy.data.lights.new(kind.title(), kind) for kind in ("POINT", "SUN", "SPOT", "AREA")]
    if bpy.app.version < (5, 0, 0):
        for light in lights[:2]:
            light.use_nodes = True
    camera = bpy.data.cameras.new("Camera")
    camera.type = "PANO"
    mesh = bpy.data.objects.new("Mesh", bpy.data.meshes.new("Mesh"))
    return {
        "render": {},
        **{f"light {light.type}": {"light": light} for light in lights},
        "camera": {"camera": camera},
        "mesh": {"object": mesh},
        "lamp": {"object": bpy.data.objects.new("Lamp", lights[0])},
        "material": {"material": bpy.data.materials.new("Material")},
        "world": {"world": bpy.data.worlds.new("World")},
    }


def test_every_panel_draws_somewhere(scene, ui):
    contexts = owners()
    bpy.context.view_layer.use_pass_mist = True
    ui.render_panels.warning_log.add(scene.name, ["Material “A”: a sentence that is long enough to be broken twice"])
    for panel in ui.CLASSES:
        drawn = {name: draw(panel, **context) for name, context in contexts.items()}
        assert any(drawn.values()), panel.__name__


def test_no_panel_draws_with_another_engine(scene, ui):
    for panel in ui.CLASSES:
        for context in owners().values():
            assert draw(panel, engine="CYCLES", **context) == []


FOR_SCRIPTS = {
    "film_from",
    "exact_walks",
    "sss_analog_escape",
    "sss_max_scatters",
    "sss_thickness_aware",
}  # and comparisons


def test_every_scene_setting_and_pass_is_shown(scene, ui):
    from restir_engine.properties import RestirSceneSettings
    from restir_engine.reuse_settings import OPTIONS
    from restir_engine.settings import PASSES

    drawn = {name for panel in ui.CLASSES for name in draw(panel)}
    assert set(RestirSceneSettings.__annotations__) - drawn == {"is_initialized", "reuse"} | FOR_SCRIPTS
    assert {name for name in OPTIONS if name in drawn} == {name for name in OPTIONS if OPTIONS[name].panel}
    switches = {item.view_layer or item.own for item in PASSES} - {""}  # what others are divided by has none
    assert switches - drawn == {"use_pass_combined"}


def test_every_material_setting_is_shown(scene, ui):
    from restir_engine.properties import RestirMaterialSettings

    context = owners()["material"]
    drawn = {name for panel in ui.CLASSES for name in draw(panel, **context)}
    assert set(RestirMaterialSettings.__annotations__) <= drawn


def test_settings_come_from_properties_one_to_one(scene):
    """Every field of RenderSettings is set by a property, Blender's or ours, and every one of ours sets a field."""
    from restir_engine.properties import RestirSceneSettings, render_settings
    from restir_engine.settings import RenderSettings

    fields = set(RenderSettings.__dataclass_fields__)
    own = set(RestirSceneSettings.__annotations__)
    assert fields - own == {
        "film_transparent",
        "film_transparent_glass",
        "film_transparent_roughness",
        "pass_alpha_threshold",
        "mist",
        "occlusion_distance",
        "first_surface_only",
        "passes",
        "aovs",
        "light_groups",
        "scene_samples",
        "extra_transparent",
        "graded_features",
    }
    of_previews = {"preview_samples", "preview_sss_method", "use_preview_denoising"}
    assert own - fields == {"use_animated_seed", "is_initialized", "film_from", "bake_type", *of_previews}
    scene.restir.clamp_direct, scene.restir.pixel_filter, scene.restir.seed = 3.0, "BOX", 5
    scene.render.film_transparent, scene.frame_current = True, 4
    settings = render_settings(scene, bpy.context.view_layer)
    assert (settings.clamp_direct, settings.pixel_filter, settings.seed) == (3.0, "BOX", 9)
    assert settings.film_transparent


def test_options_of_reuse_come_from_one_record(scene):
    """Properties have its fields, defaults and choices, and settings have what they are set to."""
    from dataclasses import asdict, fields

    from restir_engine.properties import RestirReuseSettings, render_settings
    from restir_engine.reuse_settings import OPTIONS, ReuseSettings

    reuse = scene.restir.reuse
    assert set(RestirReuseSettings.__annotations__) == set(OPTIONS) == {f.name for f in fields(ReuseSettings)}
    for name, option in OPTIONS.items():
        found = RestirReuseSettings.bl_rna.properties[name]
        assert (found.name, found.description) == (option.label, option.text)
        if option.choices:
            assert [item.identifier for item in found.enum_items] == [choice for choice, _, _ in option.choices]
    for name, value in asdict(ReuseSettings()).items():
        found = getattr(render_settings(scene, bpy.context.view_layer).reuse, name)
        assert found == (pytest.approx(value, rel=1e-7) if isinstance(value, float) else value)
    reuse.mis, reuse.rounds, reuse.radius, reuse.temporal = "BALANCE", 2, 4.0, True
    found = render_settings(scene, bpy.context.view_layer).reuse
    assert (found.mis, found.rounds, found.radius, found.temporal) == ("BALANCE", 2, 4.0, True)


def shown() -> set[str]:
    """Names of Blender's own panels that show with this engine."""
    panels = [p for p in bpy.types.Panel.__subclasses__() if p.__module__.startswith("bl_ui")]
    return {p.__name__ for p in panels if "RESTIR" in getattr(p, "COMPAT_ENGINES", ())}


def test_blenders_panels_for_all_engines_show(scene, ui):
    ui.set_compatible(True)
    names = shown()
    ui.set_compatible(False)
    expected = {"RENDER_PT_color_management", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface", "DATA_PT_lens"}
    assert expected <= names
    assert not any(name.startswith("RENDER_PT_eevee") for name in names)
    assert shown() == set()
