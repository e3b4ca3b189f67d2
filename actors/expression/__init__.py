"""The expression language: the contents of `${...}` in a model and of parameters of actors that compute."""

from .budget import Budget, BudgetError
from .evaluation import check_names, evaluate, interpolate, names_in
from .formula import DOTTED, Formula, FormulaParameter, PortFormula, PortFormulaParameter, as_text, check_no_constant
from .of_token import TokenFormula, TokenFormulaParameter, field_of
from .syntax import ExpressionError
from .tokens import operand, value_at
from .translation import UNDECIDED
from .values import CONSTANTS, FUNCTIONS, text_of

__all__ = [
    "CONSTANTS", "DOTTED", "FUNCTIONS", "UNDECIDED", "Budget", "BudgetError", "ExpressionError", "Formula",
    "FormulaParameter", "PortFormula", "PortFormulaParameter", "TokenFormula", "TokenFormulaParameter", "as_text",
    "check_names", "check_no_constant", "evaluate", "field_of", "interpolate", "names_in", "operand", "text_of",
    "value_at",
]  # fmt: skip
