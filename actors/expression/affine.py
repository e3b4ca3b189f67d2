"""Expressions that are linear in some names, taken apart: the factor of each, and what is added."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Mapping
from typing import Final

from .formula import Formula
from .syntax import free_names, parse

REST: Final = ""  # the key of what is added
_Parts = dict[str, ast.expr]


@functools.lru_cache(maxsize=1024)
def factors_of(source: str, names: frozenset[str]) -> Mapping[str, Formula] | None:
    """``rest + factor * name + ...`` as formulas over all other names, ``rest`` under ``REST``.

    A name that does not occur has no factor, and nothing is added if ``REST`` is missing.  None if the expression is
    not linear in the names by its form.
    """
    parts = _parts(parse(source), names)
    return None if parts is None else {name: Formula(ast.unparse(tree)) for name, tree in parts.items()}


def _parts(node: ast.expr, names: frozenset[str]) -> _Parts | None:
    if free_names(node, frozenset()).isdisjoint(names):
        return {REST: node}
    match node:
        case ast.Name(id=name):
            return {name: ast.Constant(1.0)}
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            return _each(_parts(operand, names), lambda part: ast.UnaryOp(node.op, part))
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
            return _summed(_parts(left, names), node.op, _parts(right, names))
        case ast.BinOp(left=left, op=ast.Mult() | ast.Div(), right=right):
            if free_names(right, frozenset()).isdisjoint(names):
                return _each(_parts(left, names), lambda part: ast.BinOp(part, node.op, right))
            if isinstance(node.op, ast.Mult) and free_names(left, frozenset()).isdisjoint(names):
                return _each(_parts(right, names), lambda part: ast.BinOp(left, node.op, part))
    return None


def _each(parts: _Parts | None, made: Callable[[ast.expr], ast.expr]) -> _Parts | None:
    return None if parts is None else {name: made(part) for name, part in parts.items()}


def _summed(one: _Parts | None, sign: ast.operator, other: _Parts | None) -> _Parts | None:
    if one is None or other is None:
        return None
    found = dict(one)
    for name, part in other.items():
        if name in found:
            found[name] = ast.BinOp(found[name], sign, part)
        else:
            found[name] = ast.UnaryOp(ast.USub(), part) if isinstance(sign, ast.Sub) else part
    return found
