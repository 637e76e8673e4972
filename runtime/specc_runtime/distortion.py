"""Errors of measurement: a factor and a bias on the numbers that a sensor gives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np


@dataclass(frozen=True, slots=True)
class Distortion:
    """What is measured is `scale * exact + bias`: one number for all, or one for each of (n,)."""

    scale: tuple[float, ...] = (1.0,)
    bias: tuple[float, ...] = (0.0,)

    def numbers(self, exact: Any) -> Any:
        """The measured numbers (n,); infinite ones, of range finders, stay infinite."""
        with np.errstate(over="ignore", invalid="ignore"):  # 0 times an infinite one is replaced
            distorted = np.asarray(self.scale) * exact + np.asarray(self.bias)
        return np.where(np.isinf(exact), exact, distorted)

    def value(self, exact: Any) -> Any:
        """A measured number or vector; what is neither stays as it is, to be refused as such."""
        if isinstance(exact, bool | str | None):
            return exact
        try:
            numbers = np.array(exact, dtype=np.float64)
            measured = self.numbers(numbers.ravel()).reshape(numbers.shape)
        except (TypeError, ValueError):
            return exact
        if not numbers.ndim:
            return float(measured)
        measured.setflags(write=False)
        return measured


class Distortable(Protocol):
    """A plant that computes samples from what is measured, and distorts that itself.

    The samples of any other plant are distorted as it gives them.
    """

    def distort(self, element: str, distortion: Distortion | None) -> None:
        """Distort what is measured for an element from now on, or not any more."""


def joined(
    scales: Iterable[Sequence[float]], biases: Iterable[Sequence[float]]
) -> Distortion | None:
    """Several errors of one element at once: factors multiply, biases add up."""
    found = [np.asarray(scale) for scale in scales], [np.asarray(bias) for bias in biases]
    if not any(found):
        return None
    scale, bias = np.ones(1), np.zeros(1)
    with np.errstate(over="ignore"):  # what is too large is refused as a sample
        for factors in found[0]:
            scale = scale * factors
        for added in found[1]:
            bias = bias + added
    return Distortion(tuple(scale.tolist()), tuple(bias.tolist()))
