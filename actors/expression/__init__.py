"""The expression language: the contents of `${...}` in a model and of parameters of actors that compute."""

from .evaluation import check_names, evaluate, interpolate, names_in
from .formula import DOTTED, Formula, FormulaParameter, PortFormula, PortFormulaParameter, operand, value_at
from .of_token import field_of, number_of_token, of_token
from .syntax import ExpressionError
from .values import CONSTANTS, FUNCTIONS, Budget, BudgetError, text_of

__all__ = [
    "CONSTANTS", "DOTTED", "FUNCTIONS", "Budget", "BudgetError", "ExpressionError", "Formula", "FormulaParameter",
    "PortFormula", "PortFormulaParameter", "check_names", "evaluate", "field_of", "interpolate", "names_in",
    "number_of_token", "of_token", "operand", "text_of", "value_at",
]  # fmt: skip
