"""A Blender for a session of an Open Job Description: started when the session begins, it renders its tasks.

    restir_farm start --session FOLDER --scene FILE …    the session's environment is entered
    restir_farm run --session FOLDER --frame 7 …         a task
    restir_farm stop --session FOLDER                    the environment is left

Blender stays open between these commands and listens at a port of this machine, whose number and key are in a file of
the session's folder. Where that file goes, or whoever asked for a task, Blender ends by itself.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import secrets
import subprocess
import sys
import threading
import time
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path

from .child import START, command, detached, environment
from .tasks import FINISH, FRAME, SAMPLES, Job, Task

ADDRESS, JOB, LOG = "restir-address.json", "restir-job.json", "restir.log"  # in the session's folder
POLL = 0.1  # seconds between looks for a Blender that starts
WATCH = 2.0  # seconds between looks of Blender at who it is for


def add_commands(commands) -> None:
    """Add what this module does to a command's parsers."""
    for name, text in (
        ("start", "start Blender for a session"),
        ("serve", "what start starts"),
        ("run", "render a task in the session's Blender"),
        ("stop", "end the session's Blender"),
    ):
        parser = commands.add_parser(name, help=text)
        parser.add_argument("--session", type=Path, required=True, help="a folder of the session's own")
        if name == "start":
            parser.add_argument("--scene", required=True)
            parser.add_argument("--output", default="")
            parser.add_argument("--engine", default="RESTIR")
            parser.add_argument("--samples", type=int, default=0)
            parser.add_argument("--samples-per-task", type=int, default=0)
            parser.add_argument("--enable-autoexec", action="store_true")
        elif name == "run":
            parser.add_argument("--frame", type=int, required=True)
            parser.add_argument("--first", type=int, default=0, help="the first sample of a range, counted from 1")
            parser.add_argument("--finish", action="store_true", help="make a frame of its ranges")


def run_command(options: argparse.Namespace) -> int:
    """Do what one of the commands says; the exit code."""
    return {"start": start, "serve": serve, "run": run, "stop": stop}[options.command](options)


def start(options: argparse.Namespace) -> int:
    """Start Blender and have it open the file."""
    from .tasks import digest_of

    scene = Path(options.scene).absolute()
    if not scene.exists():
        return _fail(f"“{scene}” is not to be seen here")
    output = options.output
    if output and not output.startswith("//"):
        output = os.path.abspath(output) + (os.sep if output.endswith(("/", os.sep)) else "")
    job = Job(
        scene=str(scene),
        output=output,
        samples=options.samples,
        samples_per_task=options.samples_per_task,
        engine=options.engine,
        scripts=options.enable_autoexec,
        again=True,
        digest=digest_of(scene),
    )
    (options.session / JOB).write_text(json.dumps(job.fields()), "utf-8")
    outcome = _ask(options.session, {"do": "facts", "job": job.fields()})
    if outcome["ok"]:
        for line in outcome["warnings"]:
            print(f"Warning: {line}")
        print(f"{scene} is open: {len(outcome['frames'])} frames, {outcome['samples']} samples, {outcome['path']}")
        return 0
    return _fail(outcome["text"])


def run(options: argparse.Namespace) -> int:
    """Render a task."""
    job = Job.of(json.loads((options.session / JOB).read_text("utf-8")))
    if options.finish:
        task = Task(FINISH, options.frame)
    elif options.first:
        task = Task(SAMPLES, options.frame, options.first - 1, job.samples_per_task)
    else:
        task = Task(FRAME, options.frame)
    print(f"openjd_status: Rendering {task}", flush=True)
    outcome = _ask(options.session, {"do": "task", "job": job.fields(), "task": task.fields()}, task.count)
    if not outcome["ok"]:
        return _fail(f"{task}: {outcome['text']}")
    for line in outcome["warnings"]:
        print(f"Warning: {line}")
    print("\n".join(f"Written: {path}" for path in outcome["written"]))
    print("openjd_progress: 100", flush=True)
    return 0


def stop(options: argparse.Namespace) -> int:
    """End Blender, if it is there."""
    with contextlib.suppress(OSError, ValueError, EOFError), _connection(options.session) as connection:
        connection.send({"do": "end"})
        connection.recv()  # until it has ended
    (options.session / ADDRESS).unlink(missing_ok=True)
    return 0


def serve(options: argparse.Namespace) -> int:
    """In Blender: answer requests until the file with the address goes."""
    from .service import Service, flush

    place, key = options.session / ADDRESS, secrets.token_bytes(32)
    service = Service()
    with Listener(("127.0.0.1", 0), authkey=key) as listener:
        content = json.dumps({"port": listener.address[1], "key": key.hex(), "pid": os.getpid()})
        unfinished = place.with_suffix(".new")
        with open(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
            file.write(content)
        os.replace(unfinished, place)
        _when(lambda: not _says(place, content), lambda: os._exit(0))
        while True:
            with contextlib.suppress(OSError, EOFError), listener.accept() as connection:
                request = connection.recv()
                if request["do"] == "end":
                    os._exit(0)
                done = threading.Event()
                _when(lambda c=connection, d=done: not d.is_set() and _is_gone(c), lambda: os._exit(1), done)
                outcome = service.answer(request, connection.send)
                done.set()
                flush()
                connection.send(outcome)


def _when(condition, action, done: threading.Event | None = None) -> None:
    """Do something once a condition is met, on a thread, until `done` is set."""

    def watch() -> None:
        while not (done and done.is_set()):
            if condition():
                action()
            time.sleep(WATCH)

    threading.Thread(target=watch, daemon=True).start()


def _says(path: Path, content: str) -> bool:
    try:
        return path.read_text("utf-8") == content
    except OSError:
        return False


def _is_gone(connection: Connection) -> bool:
    """Whether the other side, which sends nothing more, has closed a connection."""
    try:
        return connection.poll(0)
    except OSError:
        return True


def _ask(session: Path, request: dict, samples: int = 0) -> dict:
    """The outcome of a request to the session's Blender; what it prints meanwhile is printed."""
    log = session / LOG
    begun = log.stat().st_size if log.exists() else 0
    try:
        with _connected(session) as connection:
            connection.send(request)
            while "ok" not in (message := connection.recv()):
                if samples:
                    print(f"openjd_progress: {100.0 * message['samples'] / samples:.1f}", flush=True)
        outcome = message
    except (OSError, EOFError) as error:
        outcome = {"ok": False, "text": f"Blender has ended ({error or type(error).__name__})"}
    with contextlib.suppress(OSError), log.open(errors="replace") as file:
        file.seek(begun)
        sys.stdout.write(file.read())
        sys.stdout.flush()
    return outcome


def _connected(session: Path) -> Connection:
    """A connection to the session's Blender, which is started where there is none."""
    with contextlib.suppress(OSError, ValueError):
        return _connection(session)
    with (session / LOG).open("a") as log:
        process = subprocess.Popen(
            command(_this_blender(), "serve", "--session", str(session)),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env=environment(),
            **detached(),
        )
    end = time.monotonic() + START
    while time.monotonic() < end and process.poll() is None:
        with contextlib.suppress(OSError, ValueError):
            return _connection(session)
        time.sleep(POLL)
    process.kill()
    raise OSError("it could not be started")


def _connection(session: Path) -> Connection:
    found = json.loads((session / ADDRESS).read_text("utf-8"))
    return Client(("127.0.0.1", found["port"]), authkey=bytes.fromhex(found["key"]))


def _this_blender() -> str:
    """The Blender that this runs in; "" where it is a Python with bpy."""
    bpy = sys.modules.get("bpy")
    return bpy.app.binary_path if bpy is not None else ""


def _fail(text: str) -> int:
    print(f"openjd_fail: {text}", flush=True)
    return 1
