"""The 3D view: reads what it shows, hands it to a live session, and draws the picture that this has so far."""

from __future__ import annotations

import contextlib
import logging

import bpy
import numpy as np

from . import properties
from .engine import unexpected
from .live_session import LiveSession
from .scene.errors import SceneError
from .settings import RenderSettings
from .sync.camera import sync_view
from .sync.live import LiveReader

log = logging.getLogger(__name__)

REDRAW_INTERVAL = 0.04  # seconds until the view is drawn again while there is more to come


class Viewport:
    """A 3D view: what is read for it, and how the viewport's picture is drawn.

    The engine comes with every call: kept, it would never be given up while this is not.
    """

    def __init__(self) -> None:
        self._session = LiveSession()
        self._reader = LiveReader()
        self._scene = self._settings = self._camera = self._texture = None
        self._shown = None  # the picture in the texture
        self._problem = ""
        self._will_draw = False

    def __del__(self) -> None:
        # Blender gives up an engine without a word; in a __del__ of its own its attributes cannot be read any more.
        self._session.close()

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what has changed of the scene and render it, where it can be seen: a selection cannot."""
        settings, known = settings_of(depsgraph), self._settings
        self._problem, self._settings = "", settings
        try:
            camera = sync_view(context, depsgraph)
            scene = self._reader.read(depsgraph, settings, camera, context.space_data)
            if scene is not None or settings != known or not camera.same_as(self._camera):
                self._scene, self._camera = scene or self._scene, camera
                self._session.show(self._scene, settings, camera)
        except SceneError as error:
            self._problem = str(error)
        except Exception as error:
            log.exception("Reading the scene failed")
            self._problem = unexpected("The scene could not be read", error)

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Follow the view and the settings where they have changed, and draw the picture so far."""
        if settings_of(depsgraph) != self._settings:
            self.update(context, depsgraph)
        if self._scene is not None and not self._problem:
            camera = sync_view(context, depsgraph)
            if not camera.same_as(self._camera):
                self._camera = camera
                self._session.show(self._scene, self._settings, camera)
        if self._session.busy and not self._will_draw:
            self._will_draw = True
            bpy.app.timers.register(lambda: self._draw_again(engine), first_interval=REDRAW_INTERVAL)
        picture = self._session.picture
        if picture is not None:
            self._draw(picture, engine, context.region, depsgraph.scene_eval)
        error = self._session.error
        problem = self._problem or (unexpected("The render stopped", error) if error else "")
        engine.update_stats("", problem or self._session.line)

    def _draw_again(self, engine: bpy.types.RenderEngine) -> None:
        self._will_draw = False
        with contextlib.suppress(ReferenceError):  # the view may be gone
            engine.tag_redraw()

    def _draw(
        self, picture: np.ndarray, engine: bpy.types.RenderEngine, region: bpy.types.Region, scene: bpy.types.Scene
    ) -> None:
        import gpu  # which does not load without a window before Blender 5.2
        from gpu_extras.presets import draw_texture_2d

        if picture is not self._shown:
            height, width = picture.shape[:2]
            buffer = gpu.types.Buffer("FLOAT", picture.size, picture.ravel())
            self._texture, self._shown = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer), picture
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        draw_texture_2d(self._texture, (0, 0), region.width, region.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")


def settings_of(depsgraph: bpy.types.Depsgraph) -> RenderSettings:
    """The settings as the artist sees them: the evaluated scene may have older ones."""
    return properties.viewport_settings(depsgraph.scene, depsgraph.view_layer)
