"""A Blender that renders what it is asked for, request after request.

    python -m restir_engine.farm.service pipe          with Blender as a module
    blender --command restir_farm pipe                 with Blender and the extension

Requests are lines of JSON on the standard input; each is answered by lines on the standard output that begin with
MARK, among what Blender prints there: any number that tell of progress, then one with the outcome. When the input ends,
so does the process, whatever it is doing: its owner is gone. `session` serves an Open Job Description's session in the
same way, see `session.py`.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import queue
import socket
import sys
import threading
from collections.abc import Callable

from .tasks import Job, Task

MARK = "RESTIR-FARM "
HOST, SCENE = "HOST", "SCENE"  # who is to blame for a failure: another machine may render the task, or none


class Service:
    """Answers requests by a Renderer."""

    def __init__(self) -> None:
        from .renderer import Renderer, version

        self._renderer = Renderer()
        self.greeting = {"ready": True, "version": version(), "host": socket.gethostname(), "pid": os.getpid()}

    def answer(self, request: dict, tell: Callable[[dict], None]) -> dict:
        """The outcome of a request: what it asked for with `ok`, or why not; tell: of progress."""
        from .renderer import NotRendered

        try:
            return {"ok": True} | self._do(request, tell)
        except NotRendered as error:
            failure = {"blame": SCENE, "text": str(error)}
        except MemoryError:
            failure = {"blame": HOST, "text": f"{socket.gethostname()} has not enough memory"}
        except OSError as error:
            failure = {"blame": HOST, "text": str(error)}
        except Exception as error:  # whatever it is, other tasks are rendered
            import traceback

            traceback.print_exc()
            failure = {"blame": SCENE, "text": f"{type(error).__name__}: {error}"}
        self._renderer.close()  # the scene may be as the failed task left it
        return {"ok": False, "host": socket.gethostname()} | failure

    def _do(self, request: dict, tell: Callable[[dict], None]) -> dict:
        job = Job.of(request["job"])
        if request["do"] == "facts":
            return self._renderer.facts(job)
        if request["do"] == "begin":
            self._renderer.begin(job, request["resume"])
            return {}
        task = Task(**request["task"])
        return self._renderer.run(job, task, lambda samples: tell({"samples": samples}))


def flush() -> None:
    """Let everything that Python, Blender and its libraries have printed go out."""
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None).fflush(None)


def serve_pipe() -> None:
    """Answer requests from the standard input until it ends."""
    sys.stdout.flush()
    os.dup2(1, 2)  # one stream, so that the owner reads what belongs to a request before its outcome
    requests: queue.SimpleQueue = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            requests.put(json.loads(line))
        os._exit(0)

    def tell(message: dict) -> None:
        os.write(1, f"\n{MARK}{json.dumps(message)}\n".encode())

    threading.Thread(target=read, name="restir-requests", daemon=True).start()
    service = Service()
    tell(service.greeting)
    while True:
        outcome = service.answer(requests.get(), tell)
        flush()
        tell(outcome)


def command(arguments: list[str]) -> int:
    """What `restir_farm` does; the exit code."""
    from . import session

    parser = argparse.ArgumentParser(prog="restir_farm", description=__doc__.partition("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("pipe", help="serve requests from the standard input")
    session.add_commands(commands)
    options = parser.parse_args(arguments)
    if options.command == "pipe":
        serve_pipe()
        return 0
    return session.run_command(options)


def with_extension(arguments: list[str]) -> int:
    """`command` in a process that has Blender as a module: inside the extension that this checkout is."""
    import importlib.util
    from pathlib import Path

    root, name = Path(__file__).resolve().parents[2], "restir_farm_extension"
    if (root / "__init__.py").exists():
        spec = importlib.util.spec_from_file_location(
            name, root / "__init__.py", submodule_search_locations=[str(root)]
        )
        sys.modules[name] = extension = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(extension)
        extension.register()
        package = f"{name}.{__package__}"
    else:  # installed without operators and panels
        from .. import engine

        engine.register()
        package = __package__
    return importlib.import_module(f"{package}.service").command(arguments)


if __name__ == "__main__":
    renders = sys.argv[1:2] in (["pipe"], ["serve"])
    code = with_extension(sys.argv[1:]) if renders else command(sys.argv[1:])
    flush()
    os._exit(code)  # Blender 4.5 as a module can hang at exit while classes are registered
