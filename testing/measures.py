"""Measures of error between images, all (height, width, ≥ 3) scene-linear."""

from __future__ import annotations

import math

import flip_evaluator
import numpy as np
from scipy.ndimage import gaussian_filter


def relmse(x: np.ndarray, reference: np.ndarray) -> float:
    """Mean of (x - r)² / (r² + 0.01) over pixels and channels without the worst 0.1 % of the pixels."""
    x, r = x[:, :, :3], reference[:, :, :3]
    errors = np.sort(((x - r) ** 2 / (r**2 + 0.01)).mean(2).ravel())
    return float(errors[: errors.size - errors.size // 1000].mean())


def noise(pictures: np.ndarray) -> float:
    """Variance between pictures (n, height, width, 3) of different seeds, relative as relMSE is; needs no reference."""
    p = pictures.astype(np.float64)
    each = np.sort((p.var(0, ddof=1) / (p.mean(0) ** 2 + 0.01)).mean(-1).ravel())
    return float(each[: each.size - max(each.size // 1000, 1)].mean())


def block_error(x: np.ndarray, reference: np.ndarray) -> float:
    """relMSE after a blur of 6 pixels on both: what averaging does not remove."""
    return relmse(*(gaussian_filter(a[:, :, :3], (6, 6, 0)) for a in (x, reference)))


def srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB values in [0, 1] as float32 (height, width, 3)."""
    x = np.clip(linear[:, :, :3], 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def flip(x: np.ndarray, reference: np.ndarray) -> float:
    """Mean LDR-FLIP after sRGB."""
    images = (np.ascontiguousarray(srgb(a)[::-1]) for a in (reference, x))
    return float(flip_evaluator.evaluate(*images, "LDR", applyMagma=False)[1])


def standard_error(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Standard error per channel of the image mean of (a + b) / 2, two images that differ in their seed.

    Pixels are taken as independent, each with the variance ((a - b) / 2)² of the mean of its two values.
    """
    return np.sqrt((((a - b) / 2) ** 2).sum((0, 1))) / (a.shape[0] * a.shape[1])


def block_means(x: np.ndarray, block: int = 8) -> np.ndarray:
    """Means over square blocks of pixels: (n, height, width, channels) → (n, rows, columns, channels)."""
    n, h, w, channels = x.shape
    return x.reshape(n, h // block, block, w // block, block, channels).mean((2, 4))


def compare(a: np.ndarray, b: np.ndarray, block: int = 8) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(relative difference of the means by channel, its standard error, z by block of pixels) of two `frames`."""
    mean = b.mean((0, 1, 2))
    off = (a.mean((0, 1, 2)) - mean) / mean
    error = np.hypot(*(x.mean((1, 2)).std(0, ddof=1) / math.sqrt(len(x)) for x in (a, b))) / mean
    a, b = block_means(a, block), block_means(b, block)
    spread = np.hypot(*(x.std(0, ddof=1) / math.sqrt(len(x)) for x in (a, b)))
    z = (a.mean(0) - b.mean(0)) / np.maximum(spread, 1e-6 * np.abs(b).mean(0) + 1e-12)  # float32 is no finer
    return off, error, z


def blocks(image: np.ndarray) -> np.ndarray:
    """Means (blocks, 8 × 8 pixels, rgb) over an image."""
    h, w, _ = image.shape
    return image.reshape(h // 8, 8, w // 8, 8, 3).swapaxes(1, 2).reshape(-1, 64, 3)


def close(estimate, exact, relative=2e-4):
    mean, error = estimate
    assert abs(mean - exact) < 4.0 * error + relative * exact, (mean, exact, error)


def polygon_irradiance(corners, point, normal):
    """Lambert's formula for a polygon of radiance 1."""
    v = [(c - point) / np.linalg.norm(c - point) for c in np.asarray(corners, float)]
    total = 0.0
    for a, b in zip(v, v[1:] + v[:1], strict=True):
        axis = np.cross(a, b)
        total += math.acos(np.clip(a @ b, -1, 1)) * (axis / np.linalg.norm(axis)) @ normal
    return abs(total) / 2.0
