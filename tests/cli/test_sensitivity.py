"""`rig sensitivity` from the command line."""

from __future__ import annotations

import json

import pytest

from .conftest import Command
from .test_bad_input import assert_explained


@pytest.mark.parametrize("method", ["sobol", "morris", "tolerance"])
def test_every_method_names_the_wall_first(rig: Command, method: str) -> None:
    arguments = ("bellow-bending-beam", "--method", method)
    outcome = rig("sensitivity", *arguments, "--samples", "256", "--json")
    assert outcome.code == 0, outcome.err
    factors = json.loads(outcome.out)["factors"]
    key = {"sobol": "total", "morris": "absolute", "tolerance": "share"}[method]
    assert max(factors, key=lambda name: factors[name][key]) == "wall"
    assert "wall" in rig("sensitivity", *arguments, "--samples", "256").out


def test_what_beam_theory_cannot_answer_asks_for_a_study(rig: Command) -> None:
    assert_explained(
        rig("sensitivity", "bellow-box-behnken", "--method", "sobol"), "finished study"
    )
