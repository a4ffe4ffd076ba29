"""Which tests run, and where: those marked `deep` with --deep alone; pictures on any process, else a file on one."""

import pytest


def pytest_addoption(parser):
    parser.addoption("--deep", action="store_true", help="every case, and statistics that need many renders")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--deep"):
        return
    deep = [item for item in items if item.get_closest_marker("deep")]
    if deep:
        config.hook.pytest_deselected(items=deep)
        items[:] = [item for item in items if not item.get_closest_marker("deep")]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Fixtures of a file are made once, as one process runs it; those scenes that share nothing fill what is left."""
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return nodeid if nodeid.startswith("tests/images") else nodeid.split("::")[0]

    return ByFile(config, log)
