"""Random streams of a run: what is random has one of its own, so that nothing else changes it."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, name: str, *sample: int) -> np.random.Generator:
    """Random stream of what is called `name`, or of one sample of it, in the run with that seed.

    It depends on nothing else, so neither what else is random nor the order matters. A sample is
    named by its number since the beginning of the run.
    """
    entropy = [seed, zlib.crc32(name.encode())]
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=sample))
