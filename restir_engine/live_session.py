"""A render that follows what is changed: a worker thread renders the latest scene and camera that it is asked for.

Who asks never waits for the worker. The first answer is a small frame, which resamples the one before it where the
integrator does: while things move these are all that is seen. When they rest, samples accumulate in full size.
"""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .scene.camera import Camera
from .scene.description import SceneDescription
from .scene.scene import Scene
from .scene.trees import Trees
from .session import PREPARING, Session, Status
from .settings import RenderSettings

if TYPE_CHECKING:
    from .integrators.resampling.history import History

log = logging.getLogger(__name__)

SMALL = 4  # a side of a small frame is so many times shorter
_MOST = 65000.0  # float16, which textures hold, ends soon after


@dataclass(frozen=True)
class Request:
    """What is to be seen. scene: committed, or its description."""

    scene: Scene | SceneDescription
    settings: RenderSettings
    camera: Camera


class LiveSession:
    """Renders the latest of its requests on a thread of its own, until it is closed."""

    def __init__(self) -> None:
        # float32 (height, width, 4), bottom row first, with associated alpha; never written to again
        self.picture: np.ndarray | None = None
        self.line = PREPARING  # for a status bar
        self.error: BaseException | None = None
        self._request: Request | None = None
        self._current: Request | None = None  # what the worker has taken
        self._changed = threading.Condition()
        self._closed = False
        self._history: dict[bool, History] = {}  # by whether in small
        self._trees = Trees(instanced=True)
        self._committed: tuple[SceneDescription, Scene] | None = None
        self._sessions = 0
        self._thread = threading.Thread(target=self._work, name="restir-live", daemon=True)
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether there will be a better picture without a further request."""
        with self._changed:
            return self._current is not None or self._request is not None

    def show(self, scene: Scene | SceneDescription, settings: RenderSettings, camera: Camera) -> None:
        """Render this from now on."""
        with self._changed:
            self._request = Request(scene, settings, camera)
            self._changed.notify()

    def close(self) -> None:
        """End the worker soon, without waiting for it; harmless when called twice."""
        with self._changed:
            self._closed = True
            self._changed.notify()

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

    def _render(self, request: Request) -> None:
        # Never cut short: while something moves there is always a newer request.
        self._session(request, True, lambda: self._closed)
        if not self._outdated():
            self._session(request, False, self._outdated)

    def _session(self, request: Request, small: bool, cancelled) -> None:
        """Render a request to its end or until `cancelled`; every session has random numbers of its own."""
        settings = in_motion(request.settings) if small else request.settings
        camera = smaller(request.camera) if small else request.camera
        settings = replace(settings, seed=settings.seed + self._sessions)
        self._sessions += 1
        session = Session(self._scene(request), settings, camera, self._history.get(small))
        session.prepare()
        session.render(cancelled, self._report, self._keep)
        if settings.reuse.temporal:
            self._history[small] = session.history

    def _scene(self, request: Request) -> Scene:
        """The scene of a request, committed when it is seen for the first time."""
        if isinstance(request.scene, Scene):
            return request.scene
        if self._committed is None or self._committed[0] is not request.scene:
            self.line = PREPARING
            self._trees.next_frame()
            before = self._committed and self._committed[1]
            self._committed = request.scene, request.scene.commit(self._trees, before)
        return self._committed[1]

    def _report(self, status: Status) -> None:
        self.line = status.line()

    def _keep(self, session: Session) -> None:
        """Copy what the session has by now, unless it was cut short: then some of its tiles may be missing."""
        if session.film.samples and not session.cancelled:
            self.picture = np.minimum(session.combined(), _MOST)


def in_motion(settings: RenderSettings) -> RenderSettings:
    """The settings of a small frame: one sample, and what reuse there is."""
    reuse = replace(settings.reuse, temporal=True, rounds=max(settings.reuse.rounds, 1))
    return replace(settings, samples=1, reuse=reuse)


def smaller(camera: Camera) -> Camera:
    """The same view in fewer pixels."""
    return replace(camera, width=-(-camera.width // SMALL), height=-(-camera.height // SMALL))
