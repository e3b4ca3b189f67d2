"""Rows of the table: actors that compute with tokens."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from . import formulas
from . import special as how
from .counterpart import Counterpart, counterpart

_GATES = {each: each for each in ("and", "or", "xor", "nand", "nor", "xnor")}
_REPLACE = counterpart(
    "TextFunction",
    "stringToEdit=text pattern=other replacement=new | output",
    special=how.replaced,
    stringToEdit="text:text",
    pattern="text:other",
    replacement="text:new",
)
_SIMPLE_REPLACE = replace(_REPLACE, special=None, fixed={"function": "replace"})
_DOUBLE = counterpart("Expression", "input=input | output", special=formulas.formula("float(input)"))
_DECIBEL = counterpart("Expression", "input=input | output", special=formulas.decibel)
# The average of whole numbers, recognized by their text, is a whole number.
_AVERAGE = "int(sum(input) / len(input)) if str(input[0]) == str(int(input[0])) else sum(input) / len(input)"
COMPUTING: Mapping[str, Counterpart] = {
    "Comparator": counterpart(
        "Comparator",
        "left right | output",
        special=how.choice(
            "comparison", "comparison", ">", {each: each for each in (">", ">=", "<", "<=", "==", "!=")}
        ),
        tolerance="number",
    ),
    "Equals": counterpart("Equals", "input* | output", tolerance="number"),
    "LogicFunction": counterpart(
        "LogicGate", "input* | output", special=how.choice("function", "function", "and", _GATES)
    ),
    "LogicGate": counterpart("LogicGate", "input* | output", special=how.choice("logic", "function", "and", _GATES)),
    "LogicalNot": counterpart("LogicGate", fixed={"function": "not"}),
    "AddSubtract": counterpart("AddSubtract", "plus* minus* | output"),
    "MultiplyDivide": counterpart("MultiplyDivide", "multiply* divide* | output"),
    "Scale": counterpart("Scale", "input factor | output", factor="number"),
    "AbsoluteValue": counterpart("MathFunction", fixed={"function": "abs"}),
    "MathFunction": counterpart(
        "MathFunction", "firstOperand=input secondOperand=input | output", special=formulas.math_function
    ),
    "UnaryMathFunction": counterpart(
        "MathFunction",
        special=how.choice(
            "function", "function", "exp", {each: each for each in ("exp", "log", "sign", "square", "sqrt")}
        ),
    ),
    "TrigFunction": counterpart(
        "MathFunction",
        special=how.choice(
            "function", "function", "sin", {each: each for each in ("sin", "cos", "tan", "asin", "acos", "atan")}
        ),
    ),
    "Round": counterpart("Expression", "input=input | output", special=formulas.rounding),
    "Accumulator": counterpart(
        "Accumulator",
        "input* reset* | output",
        init="number:initial",
        lowerBound="number:low",
        upperBound="number:high",
    ),
    "Counter": counterpart("Counter", "increment* decrement* reset* | output"),
    "Differential": counterpart("Difference", fixed={"initial": 0}),
    "Derivative": counterpart("Derivative", "input reset | output"),
    "AverageOverTime": counterpart("TimeAverage"),
    "Integrator": counterpart(
        "Integrator", "input reset | output", fixed={"method": "trapezoid"}, initialValue="number:initial"
    ),
    "Expression": counterpart("Expression", "| output", special=formulas.expression),
    "LookupTable": counterpart("LookupTable", table="list:values=[0, 1]"),
    "Limiter": counterpart("Limiter", special=how.limiter),
    "Quantizer": counterpart("Expression", "input=input | output", special=formulas.quantizer),
    "Maximum": counterpart("Extreme", "input* | maximumValue=value channelNumber=channel", fixed={"take": "greatest"}),
    "Minimum": counterpart("Extreme", "input* | minimumValue=value channelNumber=channel", fixed={"take": "least"}),
    "MaxIndex": counterpart("Extreme", "input* | output=channel", fixed={"take": "greatest"}),
    "RunningMaximum": counterpart("MovingStatistics", "input | output=max", fixed={"span": "1e8 s"}),
    "RunningMinimum": counterpart("MovingStatistics", "input | output=min", fixed={"span": "1e8 s"}),
    "Average": counterpart("MovingAverage", "input reset | output", fixed={"span": "1e8 s", "whole": True}),
    "PID": counterpart("PID", "input=measurement reset | output", special=how.pid),
    "IIR": counterpart("DiscreteFilter", numerator="list=[1.0]", denominator="list=[1.0]"),
    "MovingAverage": counterpart("MovingAverage", maxPastInputsToAverage="whole:size=10"),
    "Remainder": counterpart(
        "Expression",
        "input=input | output",
        special=formulas.formula("input - {divisor} * round(input / {divisor})", divisor=1.0),
    ),
    "ArrayElement": counterpart(
        "Expression", "input=input index=index | output", special=formulas.formula("input[{index}]", index=0)
    ),
    "ArrayLength": counterpart("Expression", "input=input | output", special=formulas.formula("len(input)")),
    "ArraySum": counterpart("Expression", "input=input | output", special=formulas.formula("sum(input)")),
    "ArrayMinimum": counterpart("Expression", "input=input | output index", special=formulas.extreme_of_array("min")),
    "ArrayMaximum": counterpart("Expression", "input=input | output index", special=formulas.extreme_of_array("max")),
    "ArrayAverage": counterpart("Expression", "input=input | output", special=formulas.formula(_AVERAGE)),
    "ArrayExtract": counterpart(
        "Expression",
        "input=input sourcePosition=sourcePosition extractLength=extractLength "
        "destinationPosition=destinationPosition outputArrayLength=outputArrayLength | output",
        special=formulas.array_extract,
    ),
    "ArrayUpdate": counterpart(
        "Expression",
        "input=input index=index value=value | output",
        special=formulas.formula("input[:{index}] + [{value}] + input[{index} + 1:]", index=0, value=1),
    ),
    "ArrayRemoveElement": counterpart(
        "Expression",
        "array=array element=element | output",
        special=formulas.formula("[each for each in array if each != {element}]"),
    ),
    "ArrayAppend": counterpart("Collect", "input* | output", fixed={"joined": True}),
    "ArraySort": counterpart("Expression", "input=input | output", special=formulas.array_sort),
    "DotProduct": counterpart(
        "Expression",
        "input1=input1 input2=input2 | output",
        special=formulas.formula("sum([input1[k] * input2[k] for k in range(len(input1))])"),
    ),
    "ArrayContains": counterpart(
        "Expression", "array=array element=element | output", special=formulas.formula("{element} in array")
    ),
    "BooleanToAnything": counterpart(
        "Expression",
        "input=input | output",
        special=formulas.formula("{trueValue} if input else {falseValue}", trueValue=1, falseValue=0),
    ),
    "DB": _DECIBEL,
    "dB": _DECIBEL,
    "LongToDouble": _DOUBLE,
    "AnythingToDouble": _DOUBLE,
    "StringToDouble": _DOUBLE,
    "StringToInt": counterpart("Expression", "input=input | output", special=formulas.formula("int(input)")),
    "StringToBoolean": counterpart("Expression", "input=input | output", special=formulas.formula("input == 'true'")),
    "StringSubstring": counterpart(
        "Expression",
        "input=input start=start stop=stop | output",
        special=formulas.formula("input[{start}:{stop}] if {stop} >= {start} else input[{start}:]", start=0, stop=0),
    ),
    "StringCompare": counterpart(
        "TextFunction",
        "firstString=text secondString=other | output",
        special=how.choice(
            "function",
            "function",
            "equals",
            {"equals": "equals", "contains": "contains", "startsWith": "starts with", "endsWith": "ends with"},
        ),
        firstString="text:text",
        secondString="text:other",
        ignoreCase="flag",
    ),
    "StringFunction": counterpart(
        "TextFunction",
        "input=text | output",
        special=how.choice(
            "function", "function", "trim", {"trim": "trim", "toLowerCase": "lower", "toUpperCase": "upper"}
        ),
    ),
    "StringIndexOf": counterpart(
        "TextFunction",
        "inText=text searchFor=other | output",
        special=how.index_of,
        fixed={"function": "find"},
        inText="text:text",
        searchFor="text:other",
        ignoreCase="flag",
    ),
    "StringMatches": counterpart(
        "TextFunction",
        "matchString=text pattern=other | output",
        special=how.plain_pattern("pattern"),
        fixed={"function": "contains"},
        matchString="text:text",
        pattern="text:other",
    ),
    "StringReplace": _REPLACE,
    "StringSimpleReplace": _SIMPLE_REPLACE,
    "StringLength": counterpart("Expression", "input=input | output", special=formulas.formula("len(input)")),
}
