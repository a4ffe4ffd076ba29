"""Renderers of a machine take turns with its cores.

One render with all cores costs less than several at once with a part each, which push one another's scenes out of the
processor's caches. What a single core does, the reading of a scene and the writing of pictures, others do meanwhile.
"""

import contextlib
import os
import time
from collections.abc import Iterator

from ..kernels.core import locks

PLACE = "farm-render-"


@contextlib.contextmanager
def turn(threads: int, cores: int = 0) -> Iterator[None]:
    """Wait until there is room for a render with so many threads, 0: all, and keep it; cores: 0: the system's.

    There is room for as many renders as have all cores together. Where no lock can be held nobody waits.
    """
    cores = cores or os.cpu_count() or 1
    places = [locks.folder() / f"{PLACE}{i}" for i in range(max(1, cores // (threads or cores)))]
    while (place := next(filter(None, map(locks.take, places)), None)) is None and os.access(places[0], os.W_OK):
        time.sleep(locks.POLL)
    with place or contextlib.nullcontext():
        yield
