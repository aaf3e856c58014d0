"""Property tests: the same examples in every run of the gate, new ones in `make slow`.

A gate that draws anew refuses changes for what they have not touched. What `make slow` finds
becomes an example of its test.
"""

import os

import pytest
from hypothesis import settings

from tests.evidence import Evidence

# no deadline anywhere: the first quantity of a process loads pint, the first frame OpenCV
settings.register_profile("gate", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "gate"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--evidence", action="store_true", help="write docs/validation/evidence anew")


@pytest.fixture
def evidence(request: pytest.FixtureRequest) -> Evidence:
    return Evidence(request.node.nodeid.split("[")[0], request.config.getoption("--evidence"))
