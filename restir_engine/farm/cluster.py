"""The farm on Dask distributed: workers that keep a Blender each, and who hands them tasks.

Dask itself gives a task to another worker when one dies. What else goes wrong is answered here, by `Plan`: a task
that a machine is to blame for is tried on others, a frame that cannot be rendered is named, and the rest goes on.
"""

from __future__ import annotations

import contextlib
import queue
import shutil
import signal
import socket
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path

from dask.system import CPU_COUNT
from distributed import (
    CancelledError,
    Client,
    Future,
    KilledWorker,
    LocalCluster,
    Worker,
    WorkerPlugin,
    get_worker,
)
from distributed.comm import get_address_host

from .child import Child, told
from .service import HOST
from .tasks import FINISH, UNFINISHED, Job, Plan, Task

RESOURCE = "restir"  # of which each worker has 1: it renders one task at a time, however many threads Dask gives it
TICK = 0.5  # seconds between looks at who is there
FAILURES = 2  # running, after which a worker gets no more tasks
CONNECTING = "15s"  # that a scheduler has to answer
ENDING = 10.0  # seconds that workers have to answer when they are told to stop
STOPPED = {"ok": False, "blame": HOST, "text": "the render was stopped"}


class RendererPlugin(WorkerPlugin):
    """A worker's Blender, which renders for one run after the other."""

    idempotent = True  # another run leaves it as it is

    def __init__(self, blender: str) -> None:
        self.name = f"restir-renderer {blender}".rstrip()
        self._blender = blender

    async def setup(self, worker: Worker) -> None:
        """Begin; Blender is started by the first task."""
        self.child = Child(self._blender)
        self.run = ""
        self.ended: set[str] = set()  # runs
        await worker.set_resources(**{RESOURCE: 1})

    def teardown(self, worker: Worker) -> None:
        """End Blender."""
        self.child.stop()


def ask(plugin: str, run: str, request: dict) -> dict:
    """On a worker: the outcome of a request to its Blender, and who it was."""
    worker = get_worker()
    renderer = worker.plugins[plugin]
    if run in renderer.ended:
        return STOPPED | {"host": socket.gethostname(), "worker": worker.address}
    renderer.run = run
    job = Job.of(request["job"])
    request = request | {"job": replace(job, cores=CPU_COUNT).fields()}  # which knows of a container's limit

    def tell(message: dict) -> None:
        worker.log_event(run, {"task": request.get("task"), **message})

    return renderer.child.ask(request, tell) | {"host": socket.gethostname(), "worker": worker.address}


def end(plugin: str, run: str, dask_worker: Worker) -> None:
    """On a worker: end Blender where it has rendered for this run last."""
    renderer = dask_worker.plugins.get(plugin)
    if renderer is not None:
        renderer.ended.add(run)
        if renderer.run == run:
            renderer.child.stop()


def tidy(state: str) -> None:
    """On a worker, when nobody renders any more: remove what was never finished."""
    if state:
        for folder in Path(state).glob(f"{UNFINISHED}*"):
            shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Let threads and processes that begin meanwhile never hear of Ctrl-C: whoever began them ends them."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # or else it is started meanwhile, and unblocks SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class FarmError(Exception):
    """Nothing can be rendered, and why."""


def _client_of(scheduler: str) -> Client:
    """Of the cluster at an address."""
    try:
        get_address_host(scheduler)  # a client that cannot begin takes a minute to end
        return Client(scheduler, set_as_default=False, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        why = "" if isinstance(error, TimeoutError) or "Timed out" in str(error) else f" ({error})"
        raise FarmError(
            f"No Dask scheduler answers at {scheduler}{why}: “dask scheduler” starts one and prints its address, such "
            "as tcp://10.0.0.1:8786, which this machine has to reach. Without --scheduler this machine renders alone."
        ) from None


@contextlib.contextmanager
def connected(scheduler: str, workers: int, dashboard: str) -> Iterator[Client]:
    """A client of the cluster at an address, or of one of so many workers on this machine."""
    if scheduler:
        with _client_of(scheduler) as client:
            try:
                yield client
            except (OSError, RuntimeError) as error:
                if client.status == "running":
                    raise
                raise FarmError(
                    f"The scheduler at {scheduler} is gone: start it and its workers again. What is written stays; the "
                    "same command with --resume renders what is missing."
                ) from error
        return
    with uninterrupted():
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0,  # Dask's own processes hold next to nothing
            dashboard_address=dashboard,
        )
    with cluster, Client(cluster, set_as_default=False) as client:
        yield client


class Run:
    """One job on a cluster."""

    def __init__(self, client: Client, job: Job, blender: str = "") -> None:
        self._client, self._job = client, job
        self._plugin = RendererPlugin(blender)
        self._run = f"restir-{uuid.uuid4().hex[:8]}"
        self._state = ""
        self._failures: Counter[str] = Counter()  # of each worker, since it did something right
        self._pending: dict[Future, tuple[Task, set[str]]] = {}
        self._events: queue.SimpleQueue = queue.SimpleQueue()

    def __enter__(self) -> Run:
        client = self._client
        client.wait_for_workers(1, timeout=None)
        try:
            client.register_plugin(self._plugin)
        except Exception as error:  # whatever a worker says
            raise FarmError(f"The workers cannot import {__package__}: {error}") from error
        client.subscribe_topic(self._run, lambda event: self._events.put((None, event[1])))
        return self

    def __exit__(self, *_) -> None:
        """End what this run has left on the workers."""
        with contextlib.suppress(Exception):  # they may be gone
            self._client.run(end, self._plugin.name, self._run)
            for future in self._pending:
                future.exception(timeout=ENDING)
            self._client.run(tidy, self._state, workers=self.workers[:1])
            self._client.unsubscribe_topic(self._run)

    @property
    def workers(self) -> list[str]:
        """The addresses of those who are there."""
        return list(self._client.nthreads())

    def prepare(self, resume: bool) -> dict:
        """What the job consists of, by one of the workers; from now on all see to it that they have the same."""
        facts = self._ask_any({"do": "facts"})
        self._job = replace(self._job, digest=facts["digest"], files=tuple(facts["files"]))
        self._state = facts["state"]
        self._ask_any({"do": "begin", "resume": resume})
        return facts

    def _ask_any(self, request: dict) -> dict:
        """The outcome of a request on the first worker that can do it."""
        failures = []
        for worker in self.workers:
            future = self._submit(request, f"{request['do']}-{uuid.uuid4().hex[:8]}", {worker}, others=True)
            outcome = future.result()
            if outcome["ok"]:
                return outcome
            failures.append(f"{outcome['host']}: {told(outcome)}")
            if outcome["blame"] != HOST:
                break
        raise FarmError("\n".join(dict.fromkeys(failures)) or "There are no workers.")

    def render(
        self,
        plan: Plan,
        on_outcome: Callable[[Task, dict], None],
        on_progress: Callable[[dict[Task, int], int], None],
    ) -> None:
        """Have all tasks of a plan rendered.

        on_outcome: called with each outcome; on_progress: every now and then, with the samples of tasks that are
        being rendered and the number of workers.
        """
        samples: dict[Task, int] = {}
        looked, there = 0.0, self.workers
        while not plan.ended:
            if time.monotonic() - looked > TICK:
                looked, there = time.monotonic(), self.workers
                self._free_stranded(plan, set(there))
            while len(self._pending) < len(self._fit(set(there))) and (task := plan.next()) is not None:
                self._begin(plan, task, set(there))
            on_progress(samples, len(there))
            with contextlib.suppress(queue.Empty):
                future, message = self._events.get(timeout=TICK)
                if future in self._pending:
                    task, _ = self._pending.pop(future)
                    samples.pop(task, None)
                    on_outcome(task, self._noted(plan, task, _outcome(future)))
                elif message and message["task"]:
                    task = Task(**message["task"])
                    if any(task == pending for pending, _ in self._pending.values()):
                        samples[task] = message["samples"]
        on_progress(samples, len(there))

    def _noted(self, plan: Plan, task: Task, outcome: dict) -> dict:
        """An outcome that the plan has been told of, with `again`: whether the task is tried again."""
        worker = outcome["worker"]
        if outcome["ok"]:
            self._failures[worker] = 0
            plan.done(task)
            return outcome
        elsewhere = outcome["blame"] == HOST
        self._failures[worker] += elsewhere
        why = f"{task}, on {outcome['host']}: {told(outcome)}"
        return outcome | {"again": plan.failed(task, why, elsewhere, worker)}

    def _fit(self, there: set[str]) -> set[str]:
        """Those workers that do not fail at whatever they are given; all, where none is left."""
        return {worker for worker in there if self._failures[worker] < FAILURES} or there

    def _begin(self, plan: Plan, task: Task, there: set[str]) -> None:
        fit = self._fit(there)
        allowed = fit - plan.avoid.get(task, set()) or fit
        allowed = set() if allowed == there else allowed
        name = f"{task.kind.lower()}-{task.frame}-{task.first}-{uuid.uuid4().hex[:8]}"
        request = {"do": "task", "task": task.fields()}
        future = self._submit(request, name, allowed, priority=int(task.kind == FINISH))
        self._pending[future] = task, allowed
        future.add_done_callback(lambda done: self._events.put((done, None)))

    def _submit(self, request: dict, key: str, workers: set[str], others: bool = False, priority: int = 0) -> Future:
        return self._client.submit(
            ask,
            self._plugin.name,
            self._run,
            request | {"job": self._job.fields()},
            key=key,
            pure=False,
            resources={RESOURCE: 1},
            workers=sorted(workers) or None,
            allow_other_workers=others and bool(workers),
            priority=priority,
        )

    def _free_stranded(self, plan: Plan, there: set[str]) -> None:
        """Let tasks whose workers are all gone be rendered by whoever is there."""
        for future, (task, allowed) in list(self._pending.items()):
            if allowed and there and not allowed & there:
                del self._pending[future]
                future.cancel(force=True)
                self._begin(plan, task, there)


def _outcome(future: Future) -> dict:
    """What became of a task, where Dask could not say so itself too."""
    try:
        return future.result()
    except KilledWorker as error:
        text = f"{error.last_worker.address if error.last_worker else 'workers'} and others before it died over it"
    except (Exception, CancelledError) as error:
        text = f"{type(error).__name__}: {error}"
    return {"ok": False, "blame": HOST, "text": text, "host": "the cluster", "worker": "", "log": [], "handlers": []}
