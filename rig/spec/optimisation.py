"""Optimisation files: what may change, what is wanted of the responses, and how to search."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Integer, Name, Number, SpecModel, require
from rig.spec.study import StudyFactor, StudyResponse, require_distinct


class WantedResponse(StudyResponse):
    """A response with a goal, a target or limits."""

    target: Number | None = Field(None, description="as 'at_least'")

    @model_validator(mode="after")
    def _one_wish(self) -> WantedResponse:
        require(self.goal is None or self.target is None, "expected 'goal' or 'target', not both")
        require(self.model != "run", "expected a model; runs cannot be searched")
        return self

    @property
    def is_objective(self) -> bool:
        """Whether it is more than a limit."""
        return self.goal is not None or self.target is not None


class CobylaSearch(SpecModel):
    """COBYLA with basin hopping from several starting points; one objective."""

    kind: Literal["cobyla"] = Field(description="which search this is")
    starts: Count = Field(4, description="beginnings from which it searches")
    hops: Integer = Field(3, ge=0, description="jumps away from the best one found")
    evaluations: Count = Field(60, description="most of one descent")
    seed: Integer = Field(0, ge=0, description="of the beginnings and jumps")


class NsgaSearch(SpecModel):
    """NSGA-II; two objectives or more, or one."""

    kind: Literal["nsga2"] = Field(description="which search this is")
    population: Integer = Field(40, ge=8, description="designs of a generation")
    generations: Count = Field(30, description="how many follow each other")
    seed: Integer = Field(0, ge=0, description="of the draws")


class BayesianSearch(SpecModel):
    """Tree-structured Parzen estimators, for answers that are dear; one objective."""

    kind: Literal["bayesian"] = Field(description="which search this is")
    evaluations: Count = Field(40, description="designs that are computed")
    seed: Integer = Field(0, ge=0, description="of the draws")


Search = Annotated[CobylaSearch | NsgaSearch | BayesianSearch, Field(discriminator="kind")]


class OptimisationSpec(SpecModel):
    """A search over fields of an actuator and its material; levels of the factors are bounds."""

    kind: Literal["optimisation"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field("", description="one line for people: what it is and what it is for")
    actuator: str = Field(description="name of a file in models/actuators, or a path")
    factors: tuple[StudyFactor, ...] = Field(
        min_length=1, description="what is varied, and between which bounds"
    )
    responses: tuple[WantedResponse, ...] = Field(
        min_length=1, description="what is wanted of the design"
    )
    search: Search = Field(description="how it is sought")

    @model_validator(mode="after")
    def _consistent(self) -> OptimisationSpec:
        require_distinct(self.factors, self.responses)
        objectives = sum(one.is_objective for one in self.responses)
        require(objectives > 0, "expected a response with a 'goal' or a 'target'")
        require(
            objectives == 1 or self.search.kind == "nsga2",
            f"{objectives} objectives need the search 'nsga2'; give the others limits instead",
        )
        return self
