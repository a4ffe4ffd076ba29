"""The 3D view: reads what it shows, hands it to a live session, and draws the picture that this has so far."""

from __future__ import annotations

import contextlib
import logging
import time

import bpy

from . import properties
from .engine import unexpected
from .live_session import LiveSession, Shown
from .scene.errors import SceneError
from .settings import RenderSettings
from .sync.camera import sync_view
from .sync.live import LiveReader

log = logging.getLogger(__name__)

LOOK_INTERVAL = 0.005  # seconds between looks whether there is a new picture to draw
LINE_INTERVAL = 0.5  # seconds between draws for the status line alone


class Viewport:
    """A 3D view: what is read for it, and how the viewport's picture is drawn.

    The engine comes with every call: kept, it would never be given up while this is not.
    """

    def __init__(self) -> None:
        self._session = LiveSession()
        self._reader = LiveReader()
        self._scene = self._settings = self._view = self._filters = self._texture = None
        self._shown = None  # the picture in the texture
        self._problem = ""
        self._past = 0
        self._looks = False
        self._line, self._drawn = "", 0.0  # what the status line says, and when it was drawn, by time.perf_counter

    def __del__(self) -> None:
        # Blender gives up an engine without a word; in a __del__ of its own its attributes cannot be read any more.
        self._session.close()

    def update(
        self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Read what has changed of the scene and render it, where it can be seen: a selection cannot."""
        if engine.past != self._past:
            self._past = engine.past
            self._reader.forget()
        settings, known = settings_of(depsgraph), self._settings
        self._problem, self._settings, self._filters = "", settings, filters(context.space_data)
        try:
            view = sync_view(context, depsgraph)
            scene = self._reader.read(depsgraph, settings, view.camera, context.space_data)
            if scene is not None or settings != known or not view.same_as(self._view):
                self._scene, self._view = scene or self._scene, view
                self._session.show(self._scene, settings, *view)
        except SceneError as error:
            self._problem = str(error)
        except Exception as error:
            log.exception("Reading the scene failed")
            self._problem = unexpected("The scene could not be read", error)

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Follow the view and the settings where they have changed, and draw the picture so far."""
        if settings_of(depsgraph) != self._settings or filters(context.space_data) != self._filters:
            self.update(engine, context, depsgraph)
        if self._scene is not None and not self._problem:
            view = sync_view(context, depsgraph)
            if not view.same_as(self._view):
                self._view = view
                self._session.show(self._scene, self._settings, *view)
        if self._session.busy and not self._looks:
            self._looks = True
            bpy.app.timers.register(lambda: self._look(engine), first_interval=LOOK_INTERVAL)
        shown = self._session.shown
        if shown is not None:
            self._draw(shown, engine, context.region, depsgraph.scene_eval)
        error = self._session.error
        problem = self._problem or (unexpected("The render stopped", error) if error else "")
        self._line, self._drawn = problem or self._session.line, time.perf_counter()
        engine.update_stats("", self._line)

    def _look(self, engine: bpy.types.RenderEngine) -> float | None:
        """Have the view drawn when there is something new; the seconds until the next look, unless `draw` asks again.

        A draw costs a picture's time where Blender draws slowly, and no sample is rendered meanwhile.
        """
        session = self._session
        is_late = time.perf_counter() - self._drawn > LINE_INTERVAL
        is_new = session.shown is not self._shown or (is_late and session.line != self._line)
        with contextlib.suppress(ReferenceError):  # the view may be gone: then all that is asked of its engine raises
            if not is_new and session.busy and engine.is_preview is not None:
                return LOOK_INTERVAL
            engine.tag_redraw()
        self._looks = False
        return None

    def _draw(
        self, shown: Shown, engine: bpy.types.RenderEngine, region: bpy.types.Region, scene: bpy.types.Scene
    ) -> None:
        import gpu  # which does not load without a window before Blender 5.2
        from gpu_extras.presets import draw_texture_2d

        if shown is not self._shown:
            height, width = shown.pixels.shape[:2]
            buffer = gpu.types.Buffer("FLOAT", shown.pixels.size, shown.pixels.ravel())
            self._texture, self._shown = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer), shown
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        left, bottom, right, top = place_of(shown)
        corner = left * region.width, bottom * region.height
        draw_texture_2d(self._texture, corner, (right - left) * region.width, (top - bottom) * region.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")


def place_of(shown: Shown) -> tuple[float, float, float, float]:
    """Where a picture lies in the view that it was rendered for: left, bottom, right, top in units of the region."""
    left, bottom, right, top = shown.frame
    x0, y0, x1, y1 = shown.rectangle
    across, up = right - left, top - bottom
    return left + x0 * across, bottom + y0 * up, left + x1 * across, bottom + y1 * up


def filters(space: bpy.types.SpaceView3D) -> tuple:
    """What a 3D view says of the objects that it leaves out; a change of it is an update of nothing."""
    names = (item.identifier for item in space.bl_rna.properties)
    kinds = [name for name in names if name.startswith("show_object_viewport_")]
    return bool(space.local_view), space.use_local_collections, *(getattr(space, name) for name in kinds)


def settings_of(depsgraph: bpy.types.Depsgraph) -> RenderSettings:
    """The settings as the artist sees them: the evaluated scene may have older ones."""
    return properties.viewport_settings(depsgraph.scene, depsgraph.view_layer)
