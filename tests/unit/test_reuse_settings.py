"""Options of reuse are said once: the kernels' record, their numbers and the docs' table follow ReuseSettings."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from restir_engine.integrators.resampling import mis, options
from restir_engine.reuse_settings import OPTIONS, ReuseSettings, options_list

DOCS = Path(__file__).resolve().parents[2] / "docs" / "restir.md"
NUMBERS = {
    "paths": {"DIRECT": options.DIRECT_PATHS, "INDIRECT": options.INDIRECT_PATHS, "WHOLE": options.WHOLE_PATHS},
    "mis": mis.MIS_KINDS,
    "pattern": {"DISK": options.DISK, "PAIRS": options.PAIRS},
    "visibility": {name: getattr(options, name) for name in ("TARGET", "SHADED", "REUSED", "ESTIMATED")},
    "history_target": {"BEFORE": options.OF_BEFORE, "NOW": options.OF_NOW},
}


def test_the_docs_have_the_options_of_the_record():
    """Where this fails: `python -m restir_engine.reuse_settings` prints them."""
    listed = DOCS.read_text().partition("<!-- options -->\n")[2].partition("\n<!-- /options -->")[0]
    assert listed == options_list()


def test_kernels_know_every_choice_by_its_number():
    assert set(NUMBERS) == {name for name, option in OPTIONS.items() if option.choices}
    for option, numbers in NUMBERS.items():
        assert {name: options.number_of(option, name) for name, _, _ in OPTIONS[option].choices} == numbers


def test_the_record_has_what_is_set():
    settings = ReuseSettings(rounds=2, radius=5.0, mis="BALANCE", temporal=True)
    (record,) = options.reuse_records(settings, technique=7)
    for f in fields(ReuseSettings):
        value = getattr(settings, f.name)
        assert record[f.name] == (NUMBERS[f.name][value] if f.name in NUMBERS else value)
    assert record["technique"] == 7 and record["channel"] == -1
    assert record["weights"].sum() == pytest.approx(1.0)


def test_each_channel_has_a_record_of_its_own():
    records = options.reuse_records(ReuseSettings(by_channel=True), technique=0)
    assert records["channel"].tolist() == [0, 1, 2]
    np.testing.assert_array_equal(records["weights"], np.eye(3))
