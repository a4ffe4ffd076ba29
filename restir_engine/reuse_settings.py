"""What RESTIR is told: one frozen record, of which the properties, the kernels' REUSE and the docs' table are made."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field, fields

from .options import Option


def _option(default, label: str, text: str, **more):
    return field(default=default, metadata={"option": Option(label, text, **more)})


@dataclass(frozen=True)
class ReuseSettings:
    """Light samples of RESTIR and how they are reused; `scene.restir.reuse` has properties of these names."""

    pilot: bool = _option(
        True,
        "Choose by Trial",
        "Where nothing is reused, a trial at the start shows what has least noise in the same time: many points, path "
        "tracing's own choice, or, in long renders that are not denoised, whole paths of neighbors. Off is for "
        "comparisons: always from tiles",
        panel=True,
    )
    light_candidates: int = _option(
        64,
        "Light Candidates",
        "Points on lights that each light sample is chosen from. More find the important lights sooner and cost a "
        "little time. 0, or a single lamp: whole paths and indirect ones sample lights as path tracing does",
        min=0,
        soft_max=256,
        max=1024,
    )
    later_tiles: bool = _option(
        True,
        "Later Bounces",
        "Light samples after the first surface, too, are chosen from many points. Off leaves them to path tracing's "
        "own choice. Measured: off is a little faster and leaves 1.2 to 4 times the variance",
    )
    light_samples: int = _option(
        2,
        "Light Samples",
        "Light samples at the first surface for each sample of a pixel. Measured: 4 instead of 2 leave 0.85 to 0.95 of "
        "the variance and take 1.3 times as long",
        min=1,
        soft_max=8,
        max=64,
        panel=True,
    )
    exit_lights: int = _option(
        4,
        "Subsurface Light Samples",
        "Random walks: light samples where light leaves the first surface after scattering below it. Measured: 4 "
        "instead of 1 leave 0.93 of the variance of skin, more gain little",
        min=1,
        soft_max=16,
        max=64,
        panel=True,
    )
    rounds: int = _option(
        0,
        "Spatial Reuse",
        "How many times each pixel takes light samples from its neighbors. 0 turns it off. Measured: with temporal "
        "reuse 0.8 to 0.9 of the variance for a third more time; without temporal reuse, of direct light alone, it "
        "does not help",
        max=4,
        panel=True,
    )
    temporal: bool = _option(
        False,
        "Temporal Reuse",
        "Each sample reuses light samples of the one before. Measured in a moving view: a quarter of the variance "
        "under hundreds of small glowing objects, twice the variance under hundreds of colored lamps. It raises the "
        "noise of final renders, because samples become copies of each other",
        panel=True,
    )
    paths: str = _option(
        "DIRECT",
        "Resampled Light",
        "What samples are reused of, where reuse is on. Indirect light needs shadows For Each Choice, and turns reuse "
        "below surfaces off. Measured in rooms with much indirect light, after equal time: 0.16 to 0.37 of path "
        "tracing's error in a moving view, with temporal reuse and one round; 0.4 to 1.1 of it in final renders, with "
        "three rounds of four neighbors",
        choices=(
            ("DIRECT", "Direct", "Direct light at first surfaces"),
            ("INDIRECT", "Indirect", "Paths of indirect light; direct light is sampled anew in each pixel"),
            ("WHOLE", "Direct and Indirect", "Whole paths, one for both"),
        ),
    )
    footprint: float = _option(
        0.02,
        "Footprint",
        "Indirect light: how wide a path must have spread, by the pixel's footprint in hundredths, for neighbors to "
        "reconnect to it",
        min=0.0,
        soft_max=1.0,
        max=1000.0,
    )
    connect_roughness: float = _option(
        0.2,
        "Connected Roughness",
        "Indirect light: paths reconnect where the density of the bounce is below the inverse root of this",
        min=0.0001,
        max=1.0,
    )
    moving_blocks: bool = _option(
        True,
        "Moving Blocks",
        "Pairs: the blocks that pixels exchange samples in begin elsewhere in each frame. Off is for comparisons: what "
        "a block shares is seen as a square",
    )
    vector_weights: bool = _option(
        True,
        "Sum of Samples",
        "Pixels are lit by all samples that they choose from, each by its weight, and not by the one chosen alone: "
        "less noise of color",
    )
    neighbours: int = _option(3, "Neighbors", "Pixels that a pixel takes samples from in each round", min=1, max=12)
    pattern: str = _option(
        "PAIRS",
        "Pattern",
        "Which pixels spatial reuse takes samples from",
        choices=(
            ("DISK", "Disk", "Any, at random within the radius"),
            (
                "PAIRS",
                "Pairs",
                "Pixels exchange samples in pairs, in blocks as wide as the radius. Measured: spatial reuse takes "
                "0.6 times as long as with a disk, with less noise",
            ),
        ),
    )
    radius: float = _option(8.0, "Radius", "How far away the neighbors may be", min=1.0, soft_max=64.0, unit="PIXEL")
    min_cosine: float = _option(
        0.5, "Normals", "Smallest cosine between the normals of a pixel and its neighbor", max=1.0
    )
    max_depth: float = _option(
        0.1, "Depth", "How far a neighbor may lie off the pixel's tangent plane, relative to its distance", max=1.0
    )
    confidence_cap: float = _option(
        20.0,
        "History",
        "How many samples history may count for at most, against one new sample",
        min=1.0,
        soft_max=40.0,
        max=1000.0,
    )
    mis: str = _option(
        "DEFENSIVE",
        "MIS Weights",
        "How samples from several pixels are weighed against each other",
        choices=(
            ("BALANCE", "Balance", "Each against all others: the most time"),
            ("PAIRWISE", "Pairwise", "Each against the pixel's own"),
            ("DEFENSIVE", "Defensive Pairwise", "The same, with a share that is always the pixel's own"),
            ("CONTRIBUTION", "Contribution", "Balance for the sample that is chosen alone: more noise"),
            ("CONFIDENCE", "1/M (biased)", "By confidence alone. Measured: darker by 2 to 9 %"),
        ),
    )
    visibility: str = _option(
        "TARGET",
        "Shadows",
        "When shadow rays are traced",
        choices=(
            ("TARGET", "For Each Choice", "A shadow ray for every sample that is considered"),
            ("SHADED", "At the End", "Reuse ignores shadows: rays are traced for new samples, and for what is shaded"),
            (
                "REUSED",
                "Reused (biased)",
                "Samples that stay in their pixel keep their shadow. Measured: a bias below 0.5 %",
            ),
            (
                "ESTIMATED",
                "Estimated (biased)",
                "The same, averaged over all that were resampled: less noise, but colors of lights leak at edges of "
                "shadows. Measured: darker by 0.5 %; single pixels are wrong by 9 %",
            ),
        ),
    )
    near: float = _option(
        0.0,
        "Near Shadows (biased)",
        "Where shadows are reused or estimated, those of neighbors closer than this are taken as they are. 0 is off. "
        "Measured at 8 pixels: a bias below 0.3 %",
        soft_max=16.0,
        unit="PIXEL",
    )
    discard: bool = _option(
        False,
        "Discard Shadowed (biased)",
        "New samples in shadow are thrown away although neighbors might see their light. Less noise, but darker. "
        "Measured: by 2 to 6 %. Has no effect with shadows For Each Choice",
    )
    by_channel: bool = _option(
        False,
        "Each Channel Apart",
        "Red, green and blue have samples of their own: three times the work, and much less noise of color under "
        "colored lamps",
    )
    history_target: str = _option(
        "BEFORE",
        "History's Scene",
        "Which scene's lights and shadows weigh the frame before",
        choices=(
            ("BEFORE", "Its Own", "The scene as it was"),
            (
                "NOW",
                "The New One (biased)",
                "The scene as it is now: saves shadow rays through the old one. Within a still image both are the "
                "same. Measured, with lights and shadows that move: 7 % too bright",
            ),
        ),
    )


OPTIONS: dict[str, Option] = {f.name: f.metadata["option"] for f in fields(ReuseSettings)}


def options_list() -> str:
    """The options as a list in Markdown, for docs/restir.md."""
    lines = []
    for f in fields(ReuseSettings):
        option = OPTIONS[f.name]
        name = f"**`{f.name}`**" if option.panel else f"`{f.name}`"
        lines += _item("- ", f"{name} = {f.default}. *{option.label}*: {option.text}.")
        for choice, label, about in option.choices:
            lines += _item("  - ", f"`{choice}` (*{label}*): {about}.")
    return "\n".join(lines)


def _item(bullet: str, text: str) -> list[str]:
    return textwrap.wrap(
        text, 118, initial_indent=bullet, subsequent_indent=" " * len(bullet), break_on_hyphens=False,
        break_long_words=False,
    )  # fmt: skip


if __name__ == "__main__":
    print(options_list())
