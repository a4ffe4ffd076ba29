"""The render engine as Blender sees it: final frames, previews of materials and the 3D view.

The order for every view layer and frame is `update` (depsgraph → scene), then `render` (scene → film, by a session that
knows nothing of Blender, for each view of a stereoscopic render). In the 3D view it is `view_update` where something
has changed, and `view_draw`.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import bpy

from . import denoise, properties, requirements, warning_log
from .render_job import RenderJob
from .scene.errors import SceneError
from .settings import PASS_BY_NAME, Pass, shown_passes

log = logging.getLogger(__name__)

STATUS_INTERVAL = 1.0 if bpy.app.background else 0.25  # seconds between two status lines of one stage
NO_PLACE = "Blender has no place for the picture: check the render region and the resolution."
FIRST_INTERVAL, LAST_INTERVAL = 0.05, 0.8  # seconds between pictures sent to the Image Editor: at the start, later


class RestirEngine(bpy.types.RenderEngine):
    """ReSTIR in the list of engines."""

    bl_idname = "RESTIR"
    bl_label = "ReSTIR"
    bl_use_postprocess = True
    bl_use_preview = True
    bl_use_eevee_viewport = True  # Material Preview
    bl_use_shading_nodes_custom = False  # the shader editor shows the nodes that Cycles has

    # Of the render that is going on: without Persistent Data each frame of an animation has an engine of its own.
    kept = None

    job: RenderJob | None = None  # that has begun; else what Blender wants read is for a bake or a preview
    ends_at_failures = not bpy.app.background  # whether an animation ends at the first frame that fails

    turn = nullcontext  # of so many threads: samples are taken inside it

    baked = None  # the scene of the bake that is going on: each object has an engine of its own

    past = 0  # counts undo, redo and loading, after which datablocks may be others than before

    def __init__(self, *args, **kwargs) -> None:
        super().__init__(*args, **kwargs)
        self.scene = self.views = None
        self.has_read = False
        self.images = 0  # that have been baked
        self.settings = None
        self.view = None

    def update(self, data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what the view layer shows, unless Blender bakes: of what, it tells later."""
        self.scene, self.images = None, 0
        self.has_read = self.job is not None or self.is_preview
        if self.has_read and not self._is_of_failed_frame:
            self._read(depsgraph)

    def _read(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what the view layer shows into a scene of our own."""
        with failures_told(self, "The scene could not be read"):
            self._begin()
            if self._delivers_file(depsgraph):
                return
            self.update_stats("", "Reading the scene")
            of_frame = depsgraph.scene_eval, depsgraph.view_layer_eval
            artist = artists_scene() if self.is_preview else None
            self.settings = (
                properties.preview_settings(*of_frame, artist) if artist else properties.render_settings(*of_frame)
            )
            self.settings.require_samples()
            from .sync.camera import NO_CAMERA
            from .sync.depsgraph import read_scene
            from .sync.kept import Kept
            from .sync.motion import Frames
            from .sync.views import Views

            if self.job is not None and self.job.stands_in(self.camera_override or depsgraph.scene.camera):
                raise SceneError(NO_CAMERA)
            if self.is_preview:
                self.kept = Kept()
            elif self.kept is None:
                RestirEngine.kept = Kept()
            self.kept.begin((depsgraph.scene.name, depsgraph.scene.frame_current_final))
            frames = None if self.is_preview else Frames(self.frame_set, self.test_break)
            self.views = Views(self)
            self.scene = read_scene(depsgraph, self.settings, meshes=self.kept.meshes, frames=frames, views=self.views)

    def _begin(self) -> None:
        """Find what rendering needs."""
        problem = requirements.problem()
        if problem:
            raise SceneError(problem)
        configure_cache()

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render what `update` read."""
        if self._delivers_file(depsgraph):
            self._deliver_file(depsgraph)
        else:
            self._render(depsgraph)
        if self._is_of_failed_frame:
            self._deliver_nothing(depsgraph)

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        if not self.has_read:
            self._read(depsgraph)
        if self.scene is None:
            return
        with failures_told(self, "The render stopped"):
            scene, self.scene = self.scene, None
            try:
                for place, camera in enumerate(scene.cameras):
                    session = self._render_view(scene, camera, place, depsgraph)
                    scene = session.scene  # committed, for all views
                    if session.cancelled:
                        break
            finally:
                if not self.is_preview:
                    report_warnings(self, depsgraph.scene, scene.warnings)

    def _render_view(self, scene, camera, place: int, depsgraph: bpy.types.Depsgraph):
        """The session that has rendered what a camera sees of a scene, as one of the render's views."""
        from .session import Session

        session = Session(scene, self.settings, camera, trees=self.kept.trees)
        layer, view = depsgraph.view_layer.name, self.views.names[place]
        self.active_view_set(view)
        result = self.begin_result(0, 0, session.film.width, session.film.height, layer=layer, view=view)
        if result is None:
            raise SceneError(NO_PLACE)
        if place == 0:
            self._name_mattes(session, layer)
        display = Display(self, result, place, self.views.names)
        with self.turn(self.settings.threads):
            began = time.perf_counter()
            try:
                session.render(self.test_break, display.status, display.picture)
            finally:
                self._keep_record(session, depsgraph, time.perf_counter() - began)
                deliver(self, result, session)
        return session

    @property
    def _is_of_failed_frame(self) -> bool:
        """Whether what is rendered now is thrown away."""
        return self.job is not None and self.job.frame_failed

    def _deliver_nothing(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Hand over an empty picture of a frame that is thrown away: without one Blender can end as it writes it."""
        views = self.get_result().views
        for view in [view.name for view in views] or [""]:
            layer = depsgraph.view_layer.name
            result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=layer, view=view)
            if result is not None:
                self.end_result(result)

    def _delivers_file(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether a file takes the place of the render, in which this engine has what it needs."""
        return bool(depsgraph.scene.restir.film_from) and not self.is_preview and not requirements.problem()

    def _deliver_file(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Hand over the samples that a file has."""
        with failures_told(self, "The file could not be delivered"):
            from .farm.delivery import LayerFromFile

            self.update_stats("", "Reading the film")
            settings = properties.render_settings(depsgraph.scene_eval, depsgraph.view_layer_eval)
            name, path = depsgraph.view_layer.name, bpy.path.abspath(depsgraph.scene.restir.film_from)
            layer = LayerFromFile(path, name, settings, depsgraph.scene)
            for view, delivered in layer.deliveries():
                result = self.begin_result(0, 0, delivered.width, delivered.height, layer=name, view=view)
                if result is None:
                    raise SceneError(NO_PLACE)
                self._stamp(layer.fields)
                deliver(self, result, delivered)
            report_warnings(self, depsgraph.scene, layer.warnings)

    def bake(
        self, depsgraph: bpy.types.Depsgraph, item: bpy.types.Object, kind: str, parts: int, width: int, height: int
    ) -> None:
        """Render an object's surface into the pixels of an image; of several, one after the other, and no other."""
        with failures_told(self, "The bake stopped"):
            self._begin()
            self.update_stats("", "Reading the scene")
            from .baking import bake_picture, bake_settings, jitters
            from .session import Session
            from .sync.bake import BakedScene, chosen_parts, read_texels

            scene, parts = depsgraph.scene, chosen_parts(parts)
            settings = bake_settings(properties.render_settings(scene, depsgraph.view_layer_eval), kind, parts)
            if scene.restir.integrator != settings.integrator:
                log.info("Bakes are path traced")
            if self.baked is None:
                RestirEngine.baked = BakedScene()
            baked = self.baked
            described, instance = baked.read(depsgraph, settings, item, kind)
            self.images += 1  # Blender finds the image that a result is for by the name of its layer
            result = self.begin_result(0, 0, width, height, layer=f"{depsgraph.view_layer.name} {self.images}")
            from_camera = scene.render.bake.view_from == "ACTIVE_CAMERA"
            texels = read_texels(result, instance, jitters(kind, settings), from_camera)
            camera = replace(described.camera, texels=texels)
            session = Session(described, settings, camera, trees=baked.kept.trees)
            try:
                session.render(self.test_break, Display(self, result).status)
            finally:
                baked.note(session.scene)
                if session.film.samples:
                    picture = bake_picture(session, kind, parts)
                    result.layers[0].passes["Combined"].rect.foreach_set(picture.ravel())
                self.end_result(result, cancel=not session.film.samples)
                report_warnings(self, scene, session.scene.warnings)

    def _name_mattes(self, session, layer: str) -> None:
        """Tell with the picture which names the ids of its Cryptomattes stand for."""
        for kind in {PASS_BY_NAME[name].slots for name in session.settings.passes} - {""}:
            self._stamp(session.scene.manifests.metadata(kind, layer))

    def _keep_record(self, session, depsgraph: bpy.types.Depsgraph, seconds: float) -> None:
        """Tell with the picture which samples it is of, so that it can be merged with others of the same."""
        from .farm.record import record_of

        scene, layer = depsgraph.scene, depsgraph.view_layer
        if not (session.settings.is_part or scene.render.image_settings.file_format == "OPEN_EXR_MULTILAYER"):
            return
        asked = properties.enabled_passes(scene, layer)
        record = record_of(session, scene.name, scene.frame_current, asked, seconds)
        self._stamp(record.fields(layer.name))

    def _stamp(self, fields: dict[str, str]) -> None:
        """Let what is saved of the picture have these text fields."""
        for field, text in fields.items():
            self.get_result().stamp_data_add_field(field, text)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what the 3D view shows, again."""
        problem = requirements.problem()
        if problem:
            self.update_stats("", problem)
            return
        if self.view is None:
            configure_cache()
            from .viewport import Viewport

            self.view = Viewport()
        self.view.update(self, context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Show what has been rendered of it."""
        if self.view is not None:
            self.view.draw(self, context, depsgraph)

    def update_render_passes(self, scene: bpy.types.Scene, renderlayer: bpy.types.ViewLayer) -> None:
        """Tell Blender which passes there will be."""
        shown = shown_passes(
            properties.delivered_passes(scene, renderlayer),
            properties.enabled_aovs(renderlayer),
            properties.enabled_light_groups(renderlayer),
        )
        for item in shown:
            self.register_pass(scene, renderlayer, pass_name(item), len(item.channels), item.channels, item.kind)


class Display:
    """What the artist sees of a view's render in progress: status line, progress bar, the picture so far.

    views: the names of all views, which are rendered one after the other; place: that of this one among them.
    """

    def __init__(
        self, engine: RestirEngine, result: bpy.types.RenderResult, place: int = 0, views: tuple[str, ...] = ("",)
    ) -> None:
        self._engine, self._result = engine, result
        self._place, self._views = place, views
        self._line, self._line_time, self._peak = "", 0.0, 0.0
        self._picture_time, self._interval = 0.0, FIRST_INTERVAL

    def status(self, status) -> None:
        """Show where the render is."""
        now, view = time.monotonic(), self._views[self._place]
        line = f"{view}: {status.line()}" if view else status.line()
        new_stage = line.partition("|")[0] != self._line.partition("|")[0]
        if line == self._line or (not new_stage and now - self._line_time < STATUS_INTERVAL):
            return
        self._line, self._line_time = line, now
        self._engine.update_stats("", line)
        self._engine.update_progress((self._place + status.progress) / len(self._views))
        self._peak = max(self._peak, status.memory / 2**20)
        self._engine.update_memory_stats(memory_used=status.memory / 2**20, memory_peak=self._peak)

    def picture(self, session) -> None:
        """Show the samples that the film has by now; in a batch render nobody looks."""
        if bpy.app.background or time.monotonic() - self._picture_time < self._interval:
            return
        write_passes(self._result, session, [PASS_BY_NAME["Combined"]])
        self._engine.update_result(self._result)
        self._picture_time = time.monotonic()
        self._interval = min(2.0 * self._interval, LAST_INTERVAL)


@contextmanager
def failures_told(engine: RestirEngine, what: str) -> Iterator[None]:
    """Whatever is raised within ends the render with a message; what: the sentence for what nobody foresaw.

    An engine that fails without a report can take Blender down when the picture is written.
    """
    try:
        yield
    except SceneError as error:
        fail(engine, str(error))
    except Exception as error:
        log.exception(what)
        fail(engine, unexpected(what, error))


def deliver(engine: RestirEngine, result: bpy.types.RenderResult, session) -> None:
    """Hand over the samples that the film has, and give the result back to Blender in any case."""
    try:
        if session.is_valid:
            settings = session.settings
            write_passes(result, session, shown_passes(settings.passes, settings.aovs, settings.light_groups))
    finally:
        engine.end_result(result, cancel=not session.is_valid)


def artists_scene() -> bpy.types.Scene | None:
    """The scene that a preview is asked for from; the preview itself is made in a file of Blender's own."""
    scenes = [scene for scene in (bpy.context.scene, *bpy.data.scenes) if scene is not None]
    return next((scene for scene in scenes if scene.render.engine == RestirEngine.bl_idname), None)


def write_passes(result: bpy.types.RenderResult, session, shown: list[Pass]) -> None:
    """Copy passes of a session's film into Blender's render result."""
    passes = result.layers[0].passes
    for item in shown:
        target = passes.get(pass_name(item))
        if target is not None:
            pixels = session.combined() if item.name == "Combined" else session.film.pass_array(item.name)
            target.rect.foreach_set(pixels.ravel())


def pass_name(item) -> str:
    """What the running Blender calls a pass."""
    return item.name if bpy.app.version >= (5, 0, 0) else item.name_4


def unexpected(what: str, error: BaseException) -> str:
    """A sentence for an error that nobody foresaw."""
    return (
        f"{what} ({type(error).__name__}: {error}). Details are in the console; please report it with Copy Diagnostics."
    )


def fail(engine: RestirEngine, text: str) -> None:
    """End the render, or of an animation where nobody looks on the frame, with a message that says what to do."""
    engine.error_set(text)
    if engine.is_animation and engine.job is not None and not engine.ends_at_failures:
        engine.job.fail_frame(engine, text)
    else:
        engine.report({"ERROR"}, text)


def report_warnings(engine: RestirEngine, scene: bpy.types.Scene, warnings) -> None:
    """Show what could not be rendered as meant: in the info log and in the Warnings panel."""
    lines = warnings.lines()
    for line in lines:
        engine.report({"WARNING"}, line)
    warning_log.record(scene.name, lines)
    if not bpy.app.background:
        bpy.app.timers.register(redraw_properties)  # which runs on the window's thread


def redraw_properties() -> None:
    """Draw the Properties editors again, the Warnings panel in them."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


def denoiser_folders() -> list[Path]:
    """Where the running Blender keeps its libraries, on each platform."""
    base = Path(bpy.app.binary_path or bpy.__file__).parent
    return [base / "lib", base / "blender.shared", base.parent / "Resources" / "lib"]


def configure_cache() -> None:
    """Keep compiled kernels where an extension may write; outside of an extension, the default folder is used."""
    from .kernels.core import cache

    package = __package__.rpartition(".")[0]
    if package.startswith("bl_ext."):
        folder = bpy.utils.extension_path_user(package, path="kernels")  # "" where Blender has no user's folder
        cache.configure(Path(folder) if os.path.isabs(folder) else None)


@bpy.app.handlers.persistent
def give_up(scene: bpy.types.Scene | None = None, *_) -> None:
    """Forget what renders have left; after one, unless Persistent Data says that more is to come."""
    if not isinstance(scene, bpy.types.Scene) or not scene.render.use_persistent_data:
        RestirEngine.kept = None


@bpy.app.handlers.persistent
def begin_render(scene: bpy.types.Scene, *_) -> None:
    """What the engine is asked for from now on is a picture; frames begin when handlers of the file have run."""
    handlers = bpy.app.handlers.render_pre
    if begin_frame in handlers:
        handlers.remove(begin_frame)
    handlers.append(begin_frame)
    RestirEngine.job = RenderJob(scene, goes_on=not RestirEngine.ends_at_failures)


@bpy.app.handlers.persistent
def begin_frame(*_) -> None:
    """Of this frame."""
    if RestirEngine.job is not None:
        RestirEngine.job.begin_frame()


@bpy.app.handlers.persistent
def end_frame(*_) -> None:
    """Which is written."""
    if RestirEngine.job is not None:
        RestirEngine.job.end_frame()


@bpy.app.handlers.persistent
def end_render(*_) -> None:
    """No more. At the end of a batch render, where it is not missed, stands what was not rendered as meant."""
    job, RestirEngine.job = RestirEngine.job, None
    failed, count = job.end() if job is not None else "", warning_log.end_job()
    warned = f"{count} {'warning' if count == 1 else 'warnings'}" if count else ""
    if bpy.app.background and (warned or failed):
        print("ReSTIR:", ", ".join(filter(None, (warned, failed))), flush=True)


def render_for_farm(turn: Callable[[int], AbstractContextManager]) -> None:
    """Let what renders have left stay until another file is opened, as within an animation, and failures be told.

    turn: what samples are taken inside of; it is told the number of threads, 0: all.
    """
    RestirEngine.ends_at_failures, RestirEngine.turn = True, staticmethod(turn)
    for name in ("render_complete", "render_cancel"):
        handlers = getattr(bpy.app.handlers, name)
        if give_up in handlers:
            handlers.remove(give_up)


@bpy.app.handlers.persistent
def end_bake(scene: bpy.types.Scene | None = None, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Forget what a bake has left, at its end or when what the window shows has changed, as it does at the end too."""
    if RestirEngine.baked is not None and (depsgraph is None or depsgraph.mode == "VIEWPORT"):
        RestirEngine.baked = None


@bpy.app.handlers.persistent
def note_past(*_) -> None:
    """The file is another one, or as it was."""
    RestirEngine.past += 1


HANDLERS = (
    ("render_init", begin_render),
    ("render_pre", begin_frame),
    ("render_write", end_frame),
    ("render_complete", end_render),
    ("render_cancel", end_render),
    ("render_complete", give_up),
    ("render_cancel", give_up),
    ("load_pre", give_up),
    ("load_pre", end_bake),
    ("object_bake_complete", end_bake),
    ("object_bake_cancel", end_bake),
    ("depsgraph_update_post", end_bake),  # a script's bake has none of its own
    ("undo_post", note_past),
    ("redo_post", note_past),
    ("load_post", note_past),
)


def register() -> None:
    """Add the engine and its properties."""
    denoise.configure(denoiser_folders())
    properties.register()
    if not RestirEngine.is_registered:
        bpy.utils.register_class(RestirEngine)
        for name, handler in HANDLERS:
            getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Take both away; a scene that uses the engine keeps its name and says that it is missing."""
    if RestirEngine.is_registered:
        bpy.utils.unregister_class(RestirEngine)
        for name, handler in HANDLERS:
            if handler in getattr(bpy.app.handlers, name):
                getattr(bpy.app.handlers, name).remove(handler)
        give_up()
    properties.unregister()
