"""The expression language: what stands in the `${...}` of a model and in the parameters of actors that compute."""

from .evaluation import evaluate, interpolate, names_in
from .formula import Formula, FormulaParameter, operand
from .syntax import ExpressionError
from .values import CONSTANTS, FUNCTIONS

__all__ = [
    "CONSTANTS",
    "FUNCTIONS",
    "ExpressionError",
    "Formula",
    "FormulaParameter",
    "evaluate",
    "interpolate",
    "names_in",
    "operand",
]
