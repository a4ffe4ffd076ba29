"""A render that follows what is changed: a worker thread renders the latest scene and camera that it is asked for.

Who asks never waits for the worker. The first answer is a coarse picture, as fine as the time of one picture in motion
allows, which resamples the one before it where the integrator does. When things rest, pictures get finer until they
have all pixels, in which samples then accumulate; then nothing is done any more.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .denoise import denoise
from .kernels.core import workers
from .kernels.core.jit import begin, load
from .pace import Pace
from .scene.camera import Camera
from .scene.description import SceneDescription
from .scene.plain import plain_picture
from .scene.scene import Scene
from .scene.trees import Trees
from .session import PREPARING, Session, Status, format_time, memory_in_use
from .settings import RenderSettings, resampled_shift
from .upscale import KERNELS, guide_of, upscaled

if TYPE_CHECKING:
    from .integrators.resampling.history import History

log = logging.getLogger(__name__)

MOVING = 0.06  # seconds that a picture may take while something moves, so that the first is there after 0.1
GUIDED = 3  # a coarse picture is shown in so many times the pixels along a side, or in all of the view's
REUSED = 250_000  # pixels that a picture with reuse may have: it and the one before keep a kilobyte of each
DENOISING = 0.25  # of the time, at most
# What the last coarse picture counts for, in samples, among the first ones in all pixels. It is blurred within surfaces
# but has less noise; when all samples are there it is left out. Where the sky is seen it counts for nothing.
GUESS = 2.0
_MOST = 65000.0  # float16, which textures hold, ends soon after


@dataclass(frozen=True)
class Request:
    """What is to be seen. scene: committed, or its description. frame: see Shown. asked: by time.perf_counter."""

    scene: Scene | SceneDescription
    settings: RenderSettings
    camera: Camera
    frame: tuple[float, float, float, float]
    asked: float


class Shown(NamedTuple):
    """A picture, never written to again, and what it is of.

    pixels: float32 (height, width, 4), bottom row first, with associated alpha. rectangle: left, bottom, right, top of
    what they show in units of the camera's frame; frame: where that lies in a view, as whoever asked has told.
    """

    pixels: np.ndarray
    rectangle: tuple[float, float, float, float]
    frame: tuple[float, float, float, float]


class LiveSession:
    """Renders the latest of its requests on a thread of its own, until it is closed."""

    def __init__(self) -> None:
        self.shown: Shown | None = None
        self.error: BaseException | None = None
        self._line = PREPARING
        self._request: Request | None = None
        self._current: Request | None = None  # what the worker has taken
        self._changed = threading.Condition()
        self._closed = False
        self._passing: Session | None = None  # what a newer request ends at once
        self._pace = Pace(MOVING)
        self._last: tuple[int, Scene, History] | None = None  # of the last picture in motion: its step, scene, history
        self._trees = Trees(instanced=True)
        self._committed: tuple[SceneDescription, Scene] | None = None
        self._guide: tuple[Scene, Camera, np.ndarray] | None = None  # of the last coarse picture, see upscale.guide_of
        self._guess: tuple[np.ndarray, np.ndarray] | None = None  # that picture in all pixels, its weights
        self._way: tuple[RenderSettings, tuple, RenderSettings] | None = None
        self._sessions = 0
        self._denoised = self._denoising = 0.0  # when it was last done, and how long it took
        self._thread = threading.Thread(target=self._work, name="restir-live", daemon=True)
        self._thread.start()

    @property
    def picture(self) -> np.ndarray | None:
        """The pixels that are shown."""
        return self.shown and self.shown.pixels

    @property
    def line(self) -> str:
        """One line for a status bar."""
        done, total = workers.progress()
        return f"Compiling kernels: {done} of {total}" if total and self.busy else self._line

    @property
    def busy(self) -> bool:
        """Whether there will be a better picture without a further request."""
        with self._changed:
            return self._current is not None or self._request is not None

    def show(
        self,
        scene: Scene | SceneDescription,
        settings: RenderSettings,
        camera: Camera,
        frame: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0),
    ) -> None:
        """Render this from now on."""
        with self._changed:
            self._request = Request(scene, settings, camera, frame, time.perf_counter())
            self._end_passing()

    def close(self) -> None:
        """End the worker soon, without waiting for it; harmless when called twice."""
        with self._changed:
            self._closed = True
            self._end_passing()

    def wait(self, seconds: float) -> bool:
        """Wait until there is nothing left to do; False when that takes longer."""
        with self._changed:
            return self._changed.wait_for(lambda: self._current is None and self._request is None, seconds)

    def _work(self) -> None:
        while True:
            with self._changed:
                self._current = None
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._closed or self._request is not None)
                if self._closed:
                    return
                request, self._request = self._request, None
                self._current = request
            try:
                self._render(request)
                self.error = None
            except Exception as error:  # for whoever shows the picture; the next request may be better
                log.exception("The render failed")
                self.error = error

    def _outdated(self) -> bool:
        return self._closed or self._request is not None

    def _end_passing(self) -> None:
        """Let the worker see what is new. The lock is held."""
        if self._passing:
            self._passing.cancel()
        self._changed.notify()

    def _render_unless_outdated(self, session: Session, *watched: Callable) -> bool:
        """Session.render, ended as soon as there is another request; True when all samples were rendered."""
        with self._changed:
            self._passing = session
        try:
            return session.render(self._outdated, *watched)
        finally:
            self._passing = None

    def _render(self, request: Request) -> None:
        scene = self._scene(request)
        width, height = request.camera.film_size
        step = self._pace.choose(width * height)
        if request.settings.integrator == "RESTIR":
            step = max(step, math.ceil(math.sqrt(width * height / REUSED)))
        self._coarse(request, scene, step, moving=True)
        while step > 3 and not self._outdated():
            step = -(-step // 2)
            self._coarse(request, scene, step, moving=False)
        if not self._outdated():
            self._rest(request, scene)

    def _coarse(self, request: Request, scene: Scene, step: int, moving: bool) -> None:
        """One picture in pixels of so many of the view's along a side.

        moving: it goes on from the last one of this kind, and newer requests wait for it: while something moves there
        is always one.
        """
        camera = request.camera.coarser(step)
        settings = in_motion(request.settings, moving)
        history = self._history(step, scene, settings) if moving else None
        session = self._session(request, scene, settings, camera, history)
        began = time.perf_counter()
        finished = session.render(lambda: self._closed) if moving else self._render_unless_outdated(session)
        if not finished:
            return
        if moving:
            self._last = session.history and (step, scene, session.history)
        pixels, self._guess = session.combined(), None
        size = max(round(step / GUIDED), 1)
        fine = request.camera.coarser(size) if size > 1 else request.camera
        if fine.film_size != camera.film_size:
            guide = self._guide_of(scene, fine, request.settings.threads)
            pixels = upscaled(pixels, camera, fine, guide, request.settings.threads)
            if fine.film_size == request.camera.film_size:
                surfaces = guide["distance"] > 0.0
                self._guess = pixels, np.where(surfaces, np.float32(GUESS), np.float32(0.0))[..., None]
        self._pace.took(camera.film_size[0] * camera.film_size[1], time.perf_counter() - began)
        self._tell(request, session.status, camera)
        self._show(pixels, fine, request)

    def _history(self, step: int, scene: Scene, settings: RenderSettings) -> History | None:
        """What the next picture in motion may go on with.

        After an edit there is none for paths of indirect light: what lies behind their vertices was lit before it.
        """
        if self._last is None or self._last[0] != step:
            return None
        return self._last[2] if self._last[1] is scene or settings.reuse.paths == "DIRECT" else None

    def _guide_of(self, scene: Scene, camera: Camera, threads: int) -> np.ndarray:
        """upscale.guide_of, which pictures of one request share."""
        if self._guide is None or self._guide[0] is not scene or self._guide[1] is not camera:
            self._guide = scene, camera, guide_of(scene, camera, threads)
        return self._guide[2]

    def _rest(self, request: Request, scene: Scene) -> None:
        """Accumulate samples in all pixels until done, or until there is another request."""
        self._guide = None
        settings = self._chosen(request.settings, scene)
        session = self._session(request, scene, settings, request.camera)
        kinds = request.settings, _kinds_of_light(scene)
        if self._way is None or self._way[:2] != kinds:
            self._way = (*kinds, session.way)

        def keep(session: Session) -> None:
            # What was cut short may have tiles missing.
            if not session.film.samples or session.cancelled:
                return
            if not settings.use_denoising:
                self._show(self._with_guess(session.combined(), session.film.samples), session.camera, request)
            elif time.perf_counter() - self._denoised > self._denoising / DENOISING:
                began = time.perf_counter()
                pixels = denoise(session.film, settings.denoising_quality, scene.warnings)
                self._show(session.combined() if pixels is None else pixels, session.camera, request)
                self._denoised = time.perf_counter()
                self._denoising = self._denoised - began

        self._render_unless_outdated(session, lambda status: self._tell(request, status, session.camera), keep)
        if not session.cancelled:
            self._show(session.combined(), session.camera, request)

    def _with_guess(self, pixels: np.ndarray, samples: int) -> np.ndarray:
        """The mean of so many samples, and of the last coarse picture as some more of them."""
        if self._guess is None:
            return pixels
        guess, weight = self._guess
        return (samples * pixels + weight * guess) / (samples + weight)

    def _chosen(self, settings: RenderSettings, scene: Scene) -> RenderSettings:
        """The settings, with the way of lighting that was found best for them and for such lights."""
        if self._way and self._way[:2] == (settings, _kinds_of_light(scene)):
            return self._way[2]
        return settings

    def _session(
        self, request: Request, scene: Scene, settings: RenderSettings, camera: Camera, history: History | None = None
    ) -> Session:
        """A prepared session with random numbers of its own."""
        settings = replace(settings, seed=request.settings.seed + self._sessions)
        self._sessions += 1
        session = Session(scene, settings, camera, history)
        session.prepare()
        return session

    def _scene(self, request: Request) -> Scene:
        """The scene of a request, committed when it is seen for the first time."""
        if isinstance(request.scene, Scene):
            return request.scene
        if self._committed is None or self._committed[0] is not request.scene:
            self._trees.next_frame()
            before = self._committed and self._committed[1]
            if before is None:
                pixels = plain_picture(request.scene, request.camera, self._trees)
                if pixels is not None:
                    self._show(pixels, request.camera, request)
                begin(KERNELS)
            self._committed = request.scene, request.scene.commit(self._trees, before)
            load(KERNELS)
        return self._committed[1]

    def _tell(self, request: Request, status: Status, camera: Camera) -> None:
        """Say how far the render is, in the words of Cycles."""
        parts = [
            f"Time {format_time(time.perf_counter() - request.asked)}",
            f"Mem {memory_in_use() / 2**20:.0f} M",
            f"Sample {status.samples}/{request.settings.samples}",
            "{} × {}".format(*camera.film_size),
        ]
        self._line = " | ".join(parts)

    def _show(self, pixels: np.ndarray, camera: Camera, request: Request) -> None:
        self.shown = Shown(np.minimum(pixels, _MOST), camera.rectangle, request.frame)


def _kinds_of_light(scene: Scene) -> tuple:
    """What the best way of lighting depends on, roughly."""
    lights = scene.lights.record
    return int(scene.record["n_lights"]), lights["triangles"] > 0.0, lights["world"] > 0.0


def in_motion(settings: RenderSettings, temporal: bool = True) -> RenderSettings:
    """The settings of a coarse picture: one sample, and what reuse there is, in time where it is `temporal`.

    Paths of indirect light are reused, unless what was asked for is another kind of reuse: docs/results/restir-pt.md.
    """
    reuse = replace(settings.reuse, temporal=temporal, rounds=max(settings.reuse.rounds, 1))
    if resampled_shift(settings) == settings.sss_refraction == "NONE" and reuse.paths == "DIRECT":
        reuse = replace(reuse, paths="INDIRECT")
    return replace(settings, samples=1, use_denoising=False, reuse=reuse)
