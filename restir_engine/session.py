"""A render in progress: scene, integrator and film; tiles, threads, progress, cancellation.

`render` returns with whatever has been accumulated: finished, cancelled, out of time or failed, the film stays valid.
"""

from __future__ import annotations

import importlib
import logging
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .adaptive import Convergence
from .context import FrameContext
from .denoise import denoise
from .film import Film
from .kernels.core import cache, workers
from .kernels.core.jit import begin
from .scene.camera import Camera
from .scene.description import SceneDescription
from .scene.scene import Scene, has_catchers
from .scene.trees import Trees
from .settings import RenderSettings, required_passes

if TYPE_CHECKING:
    from .integrators.base import Integrator
    from .integrators.resampling.history import History

log = logging.getLogger(__name__)

PREPARING = "Preparing the scene"
POLL = 0.05  # seconds between looks at the cancel flag
INTEGRATORS = {
    "PATH": (".integrators.path.integrator", "PathIntegrator"),
    "RESTIR": (".integrators.restir.choice", "integrator_of"),
}
BATCH_SECONDS = 0.5  # what a pass over all tiles aims at, so that frames appear and Esc answers


@dataclass(frozen=True)
class Status:
    """Where a render is. `remaining` is in seconds, None while unknown; `memory` in bytes."""

    stage: str = "Starting"
    samples: int = 0
    total: int = 0
    elapsed: float = 0.0
    remaining: float | None = None
    memory: int = 0

    @property
    def progress(self) -> float:
        return self.samples / self.total if self.total else 0.0

    def line(self) -> str:
        """One line for the status bar."""
        parts = [self.stage]
        if self.total:
            parts.append(f"Sample {self.samples}/{self.total}")
        if self.remaining is not None:
            parts.append(f"Remaining {format_time(self.remaining)}")
        parts.append(f"Mem {self.memory / 2**20:.0f} M")
        return " | ".join(parts)


def format_time(seconds: float) -> str:
    """01:23.45 or 1:02:03."""
    minutes, rest = divmod(max(seconds, 0.0), 60.0)
    if minutes >= 60:
        return f"{int(minutes) // 60}:{int(minutes) % 60:02d}:{int(rest):02d}"
    return f"{int(minutes):02d}:{rest:05.2f}"


def memory_in_use() -> int:
    """Resident memory of this process in bytes; 0 where the system does not say."""
    try:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        pass
    try:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    except ImportError:
        from .embree.library import device

        return device().memory


class Session:
    """Renders a scene with `settings` into `film`.

    scene: committed, or its description, which `prepare` commits. camera: who looks, where that is not the scene's own
    camera. history: that of the session before, which a frame may resample; afterwards that of this one. trees:
    acceleration structures that earlier scenes have left.
    """

    def __init__(
        self,
        scene: Scene | SceneDescription,
        settings: RenderSettings,
        camera: Camera | None = None,
        history: History | None = None,
        trees: Trees | None = None,
    ) -> None:
        self.scene = scene
        self._trees = trees
        self.camera = camera or scene.camera
        self.settings = settings
        self.history = history
        self._integrator: Integrator | None = None
        self._range = settings.sample_range
        self.status = Status(total=len(self._range))
        width, height = self.camera.film_size
        catchers = has_catchers(scene.instances)
        asked = settings.passes, settings.use_denoising, settings.aovs, settings.light_groups
        self.film = Film(
            width, height, required_passes(*asked, catchers), settings.film_exposure, settings.film_transparent
        )
        self.film.shows_catchers &= not settings.is_part
        if settings.first_surface_only:
            self.film.take_no_more()
        self.denoised: np.ndarray | None = None
        self._cancel = threading.Event()

    @property
    def _time_limit(self) -> float:
        """Seconds that these samples may take, 0: any; so that all ranges together take what all samples may."""
        return self.settings.time_limit * self.settings.share

    def cancel(self) -> None:
        """End the render soon; safe from any thread."""
        self._cancel.set()

    @property
    def cancelled(self) -> bool:
        """Whether it was or is being cancelled."""
        return self._cancel.is_set()

    @property
    def is_valid(self) -> bool:
        """Whether the film is a picture: of samples, or of the none that fall to this view layer."""
        return self.film.samples > 0 or not self._range

    @property
    def way(self) -> RenderSettings:
        """The settings by which a render does at once what this one has found best, once it is prepared."""
        used, kind = self._integrator.settings, type(self._integrator).__name__
        name = "PATH" if kind == INTEGRATORS["PATH"][1] else "RESTIR"
        return replace(used, integrator=name, reuse=replace(used.reuse, pilot=False))

    def prepare(self) -> None:
        """Commit the scene and load the integrator on the calling thread, which `render` does on another.

        Kernels that are not in the cache are compiled first, by processes that begin with the largest.
        """
        module, name = INTEGRATORS[self.settings.integrator]
        module = importlib.import_module(module, __package__)
        begin(module.FIRST_KERNELS)
        if isinstance(self.scene, SceneDescription):
            self.scene = self.scene.commit(self._trees)
        context = FrameContext(self.scene, self.camera)
        self._integrator = getattr(module, name)(context, self.settings, self.film, history=self.history)
        self._integrator.prepare()
        self.history = self._integrator.history
        problem = cache.store().problem()
        if problem:
            self.scene.warnings.add("Render", "Kernels", problem)

    def render(
        self,
        cancelled: Callable[[], bool] = lambda: False,
        on_progress: Callable[[Status], None] = lambda status: None,
        on_frame: Callable[[Session], None] = lambda session: None,
    ) -> bool:
        """Accumulate samples until done; True when all were rendered.

        `cancelled` and `on_progress` are called on the calling thread every 0.05 s, `on_frame` after each batch of
        samples.
        Raises what a kernel raised, with the film as it was.
        """
        start = time.perf_counter()
        if not self._range:  # of a view layer with fewer samples than there are ranges
            return True
        self._report(PREPARING, start, on_progress)
        if self._integrator is None and not self._load(cancelled, start, on_progress):
            return False
        integrator = self._integrator
        threads = self.settings.threads or os.cpu_count() or 1
        with ThreadPoolExecutor(threads, "restir") as pool:
            began = time.perf_counter()
            finished = self._accumulate(integrator, pool, threads, start, cancelled, on_progress, on_frame)
        if self._trees is not None:
            self._trees.rendered(time.perf_counter() - began)
        wanted = self.settings.use_denoising and not self.settings.is_part
        if wanted and self.film.samples and not self._cancel.is_set():
            self._report("Denoising", start, on_progress)
            self.denoised = denoise(self.film, self.settings.denoising_quality, self.scene.warnings)
        self._report("Finished" if finished else "Stopped", start, on_progress)
        return finished

    def combined(self) -> np.ndarray:
        """The Combined pass, denoised when that was asked for and has been done."""
        return self.film.pass_array("Combined") if self.denoised is None else self.denoised

    def _report(self, stage: str, start: float, on_progress: Callable[[Status], None]) -> None:
        elapsed = time.perf_counter() - start
        done, total = self.film.samples, len(self._range)
        remaining = None
        if done and done < total:
            remaining = (time.perf_counter() - self._first_sample) * (total - done) / done
            if self._time_limit:
                remaining = min(remaining, self._time_limit - elapsed)
        self.status = Status(stage, done, total, elapsed, remaining, memory_in_use())
        on_progress(self.status)

    def _load(self, cancelled, start, on_progress) -> bool:
        """`prepare` in a daemon thread: Esc and quit answer at once; False when it was cancelled."""
        errors: list[BaseException] = []

        def work() -> None:
            try:
                self.prepare()
                cache.store().remove_old()
            except BaseException as error:  # handed to the calling thread
                errors.append(error)

        thread = threading.Thread(target=work, name="restir-compile", daemon=True)
        thread.start()
        stage = self.status.stage
        while thread.is_alive():
            thread.join(POLL)
            if self._stopped(cancelled):
                return False
            done, total = workers.progress()
            self._report(f"Compiling kernels: {done} of {total}" if total else stage, start, on_progress)
        if errors:
            raise errors[0]
        return True

    def _stopped(self, cancelled: Callable[[], bool]) -> bool:
        if cancelled():
            self._cancel.set()
        return self._cancel.is_set()

    def _accumulate(self, integrator, pool, threads, start, cancelled, on_progress, on_frame) -> bool:
        """Batches of samples over all tiles.

        A batch that is cut short, by Esc or by an error, is undone, so that all pixels have equal samples; only when
        not a single batch was finished are its tiles kept, those that have reached the film.
        """
        tiles = self.film.tiles()
        self._first_sample = time.perf_counter()
        limit = self._time_limit
        convergence = Convergence(self.film, self.settings) if self.settings.use_adaptive_sampling else None
        batch = 1
        while self.film.samples < len(self._range):
            batch = min(batch, len(self._range) - self.film.samples)
            if convergence:
                batch = min(batch, convergence.left)
            began = time.perf_counter()
            backup = self.film.pixels.copy() if self.film.samples else None
            complete = False
            try:
                complete = self._batch(integrator, pool, threads, tiles, batch, start, cancelled, on_progress)
            finally:
                if not complete:
                    self._undo(backup, batch)
            if not complete:
                on_frame(self)
                return False
            self.film.add_samples(batch)
            on_frame(self)
            if convergence and convergence.add():
                break
            now = time.perf_counter()
            per_sample = (now - began) / batch
            if limit and now - start >= limit:
                break
            batch = int(np.clip(BATCH_SECONDS / max(per_sample, 1e-6), 1, min(2 * batch, integrator.max_batch)))
            if limit:
                batch = max(1, min(batch, int((limit - (now - start)) / per_sample)))
        return True

    def _undo(self, backup: np.ndarray | None, samples: int) -> None:
        """Take a batch of so many samples that was cut short back; backup: the film's pixels before it."""
        if backup is not None:
            self.film.pixels[:] = backup
        elif self.film.pixels.any():
            self.film.add_samples(samples)

    def _batch(self, integrator, pool, threads, tiles, samples, start, cancelled, on_progress) -> bool:
        """One batch of samples on every tile; False when it was cancelled."""
        for stage in integrator.stages(self._range.start + self.film.samples, samples):
            items = tiles if stage.items is None else stage.items
            if not self._stage(stage, items, integrator, pool, threads, start, cancelled, on_progress):
                return False
            stage.finish()
        return True

    def _stage(self, stage, items, integrator, pool, threads, start, cancelled, on_progress) -> bool:
        """Run a stage on every item; False when it was cancelled."""
        position = iter(items)
        lock = threading.Lock()

        def work() -> None:
            scratch = integrator.scratch()
            while not self.cancelled:
                with lock:
                    item = next(position, None)
                if item is None:
                    return
                stage.run(item, scratch)

        futures: list[Future] = [pool.submit(work) for _ in range(threads)]
        pending = set(futures)
        while pending:
            _, pending = wait(pending, timeout=POLL)
            self._stopped(cancelled)
            self._report("Rendering", start, on_progress)
        for future in futures:
            future.result()
        return not self.cancelled
