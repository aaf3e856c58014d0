"""What can go wrong between a test's file and a material's parameters."""

from __future__ import annotations

from rig.errors import RigError


class FittingError(RigError):
    """Parameters that the data cannot give."""


class TestDataError(FittingError):
    """A file of test data that cannot be taken as it is; names file and line."""

    exit_code = 2
    __test__ = False  # pytest collects classes that are called Test...
