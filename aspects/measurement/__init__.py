"""Disturbances of measurement: they stand at output ports, and decide what a sensor seems to have measured."""

from .alteration import Alteration, Bias, Drift, Noise, Outlier, Quantise, Saturate, Transform
from .failure import MeasurementFailure, StuckAt

__all__ = [
    "Alteration",
    "Bias",
    "Drift",
    "MeasurementFailure",
    "Noise",
    "Outlier",
    "Quantise",
    "Saturate",
    "StuckAt",
    "Transform",
]
