"""The error family of the vision part."""

from __future__ import annotations

from rig.errors import RigError


class VisionError(RigError):
    """An image, video or calibration that cannot be worked with at all.

    A frame that can be read but not trusted is no error: it is a rejected `AngleMeasurement`.
    """

    exit_code = 5


class UntrustedFrameError(Exception):
    """Why a frame gives nothing to trust; meters turn it into a rejected measurement."""


class UnsharpFrameError(UntrustedFrameError):
    """The edges are not good enough at this resolution; a coarser one may still do."""
