"""A solver: SciPy's sequential quadratic programming."""

from typing import Any

from scipy.optimize import minimize

from epicycle.actors import Solver


class Slsqp(Solver):
    """Any dynamics and any objective, by SLSQP with differences as derivatives."""

    def solve(self, problem: Any, starts: Any) -> Any:
        shape = starts[0].shape
        kept = [
            {"type": "ineq", "fun": lambda flat: -problem.limits(flat.reshape(shape))},
            {"type": "ineq", "fun": lambda flat: -problem.constraints(flat.reshape(shape))},
        ]
        found = minimize(
            lambda flat: float(problem.cost(flat.reshape(shape))), starts[0].ravel(), constraints=kept, tol=1e-9
        )
        return problem.solution(found.x.reshape(shape), found.nit)
