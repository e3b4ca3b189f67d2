"""The JSON Schema of study files."""

from __future__ import annotations

from . import declarations as language
from .schema_parts import QUANTITY, TEXT, Schema, mapping, one_or_more, ref, text

_QUANTITY: Schema = {"type": ["number", "string"], **text(QUANTITY, "expected a number, alone or with its unit")}
_UNTIL: dict[str, tuple[Schema, str]] = {
    "metric": (ref("name"), "The metric whose mean is wanted."),
    "half_width": ({"type": "number", "minimum": 0}, "Half the width of its 95 % interval that is narrow enough."),
    "batch": ({"type": "integer", "minimum": 2}, "How many replications are made at a time (default: 10)."),
    "at_most": ({"type": "integer", "minimum": 2}, "The most replications of a condition (default: 1000)."),
}
_RANGE: dict[str, tuple[Schema, str]] = {
    "from": (_QUANTITY, "The first value."),
    "to": (_QUANTITY, "The last value, if a step falls on it."),
    "step": (_QUANTITY, "The distance between two values."),
}
_HYPERCUBE: dict[str, tuple[Schema, str]] = {
    "size": ({"type": "integer", "minimum": 1}, "The number of points."),
    "seed": ({"type": "integer", "minimum": 0}, "What the points are drawn from (default: 0)."),
    "ranges": (
        {"type": "object", "additionalProperties": {"type": "array", "items": _QUANTITY, "minItems": 2, "maxItems": 2}},
        "'path: [low, high]' for each parameter.",
    ),
}
_METRICS: Schema = {"anyOf": [ref("name"), {"type": "array", "items": ref("name"), "minItems": 1}]}
_STUDY_METRIC: dict[str, tuple[Schema, str]] = {
    "value": (TEXT, "The expression, over metrics of the model and what else a run tells."),
    "unit": (ref("text"), "What it counts in; a metric of the model has its own."),
    "to": (ref("text"), "The unit in which the table holds it (default: the same)."),
    "doc": (ref("text"), "What it is."),
}
_METRIC_OF_STUDY: Schema = {
    **mapping(language.STUDY_METRIC_KEYS, _STUDY_METRIC, "A number that is kept of each run."),
    "type": "object",
    "required": ["value"],
}
_LEVELS: Schema = {
    "type": "object",
    "minProperties": 1,
    "additionalProperties": {"anyOf": [TEXT, {"type": "array", "minItems": 1}]},
}
_SHARE: Schema = {"type": "number", "minimum": 0.5, "maximum": 1}
_CLAIM: dict[str, tuple[Schema, str]] = {
    "doc": (ref("text"), "What is claimed, in words."),
    "less": (_METRICS, "Metrics whose mean is less at some levels than at others."),
    "greater": (_METRICS, "Metrics whose mean is greater at some levels than at others."),
    "rises": (_METRICS, "Metrics whose mean, or slope per unit of another factor, rises over the levels of a factor."),
    "falls": (_METRICS, "Metrics whose mean, or slope per unit of another factor, falls over the levels of a factor."),
    "always": ({"type": "string"}, "A condition on the metrics that holds in every run."),
    "at": (_LEVELS, "Where they are less, or greater: 'factor: level' or 'factor: [level, ...]'."),
    "than": (_LEVELS, "What they are compared with (default: all other levels, so that these are the best)."),
    "over": ({"type": "string"}, "The factor over which something rises or falls."),
    "per": ({"type": "string"}, "What rises or falls is the slope over this factor."),
    "where": (_LEVELS, "The levels to which the claim is confined (default: all)."),
    "share": (_SHARE, "In how many of the comparisons, or runs, it is to hold (default: 1, in all)."),
}
_GUIDELINE: dict[str, tuple[Schema, str]] = {
    "choose": ({"type": "string"}, "The factor whose best level is wanted, for every combination of the others."),
    "least": (ref("name"), "The metric that is to be least."),
    "greatest": (ref("name"), "The metric that is to be greatest."),
    "tolerance": ({"type": "number", "minimum": 0}, "How much worse than the best is good enough (default: 0)."),
}
_STUDY: dict[str, tuple[Schema, str]] = {
    "study": (ref("name"), "The name of the study."),
    "doc": (ref("text"), "What it is to find out."),
    "model": ({"type": "string"}, "A packaged model, or the path of a file as seen from this one."),
    "set": ({"type": ["object", "null"]}, "Values for parameters of the model in all runs: 'path: value'."),
    "vary": (
        {"type": ["object", "null"], "additionalProperties": ref("dimension")},
        "What is varied; every value goes together with every one of the others.",
    ),
    "disturb": (
        {"anyOf": [{"type": "object", "additionalProperties": one_or_more({"type": "string"})}, ref("texts")]},
        "Disturbances as one more dimension: 'name: [disturbance, ...]', or a list of single ones.",
    ),
    "replications": ({"type": "integer", "minimum": 1}, "How many runs each condition has (default: 1)."),
    "seed": ({"type": "integer", "minimum": 0}, "The seed of the first replication (default: 0)."),
    "paired": ({"type": "boolean"}, "Whether a replication has the same seed in all conditions (default: true)."),
    "until": (
        {**mapping(language.UNTIL_KEYS, _UNTIL, None), "type": "object", "required": ["metric", "half_width"]},
        "How many replications each condition gets, in place of a fixed number.",
    ),
    "metrics": (
        {
            "anyOf": [
                {
                    "type": ["object", "null"],
                    "propertyNames": ref("name"),
                    "additionalProperties": {"anyOf": [TEXT, _METRIC_OF_STUDY]},
                },
                {"type": "array", "items": ref("name")},
            ]
        },
        "What is kept of each run: names of the model's metrics, or 'name: expression', or 'name: {value, unit, ...}'.",
    ),
    "claims": (
        {
            "anyOf": [
                {"type": ["object", "null"], "propertyNames": ref("name"), "additionalProperties": ref("claim")},
                {"type": "string"},
            ]
        },
        "Hypotheses on the results, by name; or the study whose claims are judged here, too.",
    ),
    "figures": (
        {"type": ["object", "null"], "propertyNames": ref("name"), "additionalProperties": ref("study_figure")},
        "What the report shows: 'name: {type, ...}' (default: means and distributions of all metrics).",
    ),
    "guideline": (
        {
            **mapping(language.GUIDELINE_KEYS, _GUIDELINE, None),
            "type": "object",
            "required": ["choose"],
            "oneOf": [{"required": ["least"]}, {"required": ["greatest"]}],
        },
        "Which level of a factor to choose, for every combination of the others.",
    ),
}
STUDY_RULES = {
    "STUDY_KEYS": _STUDY,
    "UNTIL_KEYS": _UNTIL,
    "STUDY_METRIC_KEYS": _STUDY_METRIC,
    "RANGE_KEYS": _RANGE,
    "HYPERCUBE_KEYS": _HYPERCUBE,
    "CLAIM_KEYS": _CLAIM,
    "GUIDELINE_KEYS": _GUIDELINE,
}


def study() -> Schema:
    """A study: a model under many conditions."""
    return {**mapping(language.STUDY_KEYS, _STUDY, "A model under many conditions."), "required": ["model"]}


def claim() -> Schema:
    """A hypothesis on the results of a study: one of the forms, and what belongs to it."""
    forms = {form: ["at"] for form in ("less", "greater")} | {form: ["over"] for form in ("rises", "falls")}
    return {
        **mapping(language.CLAIM_KEYS, _CLAIM, "A hypothesis on the results."),
        "type": "object",
        "oneOf": [{"required": [form, *needs]} for form, needs in {**forms, "always": []}.items()],
    }


def dimension() -> Schema:
    """One of the forms in which a study says what values something takes."""
    lists = {"type": "object", "minProperties": 1, "additionalProperties": {"type": "array", "minItems": 1}}
    cases = {"type": "object", "minProperties": 1, "additionalProperties": {"type": ["object", "null"]}}
    hypercube = {**mapping(language.HYPERCUBE_KEYS, _HYPERCUBE, None), "required": ["size", "ranges"]}
    forms = (
        ("zip", lists, "Parameters that go together: 'path: [value, ...]', all of one length."),
        ("cases", cases, "Named sets of values: 'name: {path: value}'."),
        ("latin_hypercube", hypercube, "Points that fill a box evenly."),
    )
    return {
        "description": "The values of a parameter, or of several that go together.",
        "anyOf": [
            {"type": "array", "minItems": 1},
            {
                **mapping(language.RANGE_KEYS, _RANGE, "Values at equal distances."),
                "type": "object",
                "required": list(language.RANGE_KEYS),
            },
            *(
                {
                    "type": "object",
                    "properties": {key: {**schema, "description": description}},
                    "required": [key],
                    "additionalProperties": False,
                }
                for key, schema, description in forms
            ),
        ],
    }
