"""Calibration of anisotropic-magnetoresistance (AMR) magnetometers, from a log to a self-calibrating board."""

__version__ = "0.1.0"
