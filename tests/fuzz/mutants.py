"""Mutants of good models: what accidents and malice make of a file, a tree or an option.

A mutation is a few small integers, so that Hypothesis can look for the smallest mutant that does the harm.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

Mutation = tuple[int, int, int]

TOKEN = re.compile(r"[A-Za-z_]\w*|[-\d.]+|\S")
# What may stand in place of a token of a file.
SPICE = [
    "", " ", "  ", "\n", ":", ": ", "- ", "{", "}", "[", "]", "'", '"', "&a", "*a", "!!int", "!!python/name:os.system",
    "|", ">", "#", "${", "}", "?", "${index}", "%", "null", "true", "yes", ".nan", ".inf", "-1", "1e999", "0x1F", "0o9",
    "1e9", "1e400", "[]", "{}", "[[[]]]", "a.b", "**", "*", "[*]", "->", "=>", "\t", "\x00", "\x85", "\u2028", "\ufeff",
    "\u202e", "é", "漢字", "\U0001f697", "type", "count", "value", "delay", "at", "of", "from", "to", "extends",
    "include", "<<", "---", "...", "99999999999999999999", "3 m", "10 s", "../../etc/passwd", "/etc/passwd",
    "a" * 5_000, "[" * 2_000, "${" + "(" * 900, "9" * 5_000,
]  # fmt: skip
# What may stand in place of a value of the tree.
HOSTILE: list[Any] = [
    None, True, False, 0, -1, 1, 2.5, 10**9, 10**30, -(10**400), 1e308, float("inf"), float("nan"), "", " ", "a", "0",
    "nan", "1e400", "1e400 m", "3 m", "3 s", "-5 ms", "3 m/s^999999999", "1 m*m*m*m*m*m*m*m/s", "9" * 400, "*", "**",
    "*.*", "a[*]", "a[0]", "a[999999999999]", "a..b", ".", "**.**.**.**.**.**.x", "->", "a -> b", "a.b -> c.d", "a\0b",
    "\ud7ff\ufffd\u202e", "é", "漢字" * 40, "../../etc/passwd", "/etc/passwd", "parts", ".", "x" * 20_000, [], {}, [[]],
    [None], [[[[]]]], {"type": None}, {"type": "Clock"}, {"type": "Merge", "count": 10**9}, {"a": {"a": {"a": {}}}},
    {"value": 1, "min": 2, "max": 0}, {"value": "${nope}"}, {"from": [], "to": []}, [1, "a", None, {"b": [2]}],
    list(range(300)), {"<<": {"a": 1}}, {"": 1},
    *("${" + text + "}" for text in (
        "", "index", "nope", "1/0", "9**9**9", "9.0**9**9", "-1**0.5", "(-8)**0.5", "'a'*10**9", "[0]*10**9",
        "[[0]*9999]*9999", "range(10**9)", "[i*j for i in range(99999) for j in range(99999)]",
        "[[i for i in range(999)] for j in range(999)]", "len(str(9**9**9))", "sum(range(99999))", "e**e**e**e", "inf",
        "inf - inf", "__import__('os')", "().__class__", "open('/etc/passwd')", "lambda: 1", "a.b", "{'a': 1}['b']",
        "[1, 2][5]", "(" * 80 + "1" + ")" * 80, "-" * 400 + "1", "+".join(["1"] * 300), "1 if", "'\\x00'",
        "'\\ud800'", "f'{1}'", "10**18", "10**-400", "round(1.5, 10**9)", "int('9' * 4000)", "[n for n in [1, 2, 3]]",
        "sorted([1, 'a'])", "max([])", "str(range(9999))", "0x" + "f" * 400, "1_0", "\u00b2", "1;2", "x:=3", "*[1]",
        "min(10**6, 7)", "1000", "100000", "range(1000)",
    )),
]  # fmt: skip


@dataclass(frozen=True, repr=False)
class Seedling:
    """A good model to make mutants of: its file, and the file that changes, which it may include or be disturbed by."""

    model: Path
    changing: Path
    disturb: tuple[Path, ...]
    text: str
    tree: bytes  # pickled, as the quickest way to a copy
    words: tuple[str, ...]  # names, keys and texts in it, to be put in each other's places

    def __repr__(self) -> str:
        return self.model.stem if self.model == self.changing else f"{self.model.stem}:{self.changing.stem}"


def seedling(model: Path, changing: Path, types: Iterable[str], disturb: tuple[Path, ...] = ()) -> Seedling:
    """A good model, read; ``types`` are names of actors and aspects that it may be made to have."""
    text = changing.read_text(encoding="utf-8")
    tree = yaml.safe_load(text)
    words = dict.fromkeys(str(key) for _, key in _places(tree))
    words.update(dict.fromkeys(str(holder[key]) for holder, key in _places(tree) if isinstance(holder[key], str)))
    words.update(dict.fromkeys(types))
    return Seedling(model, changing, disturb, text, pickle.dumps(tree), tuple(words))


# --- text ---------------------------------------------------------------------------------------------


def of_text(text: str, mutations: list[Mutation]) -> bytes:
    """The text after accidents of the kind that happen in an editor, and a few that do not."""
    for kind, one, other in mutations:
        text = _edit(text, kind % 10, one, other)
    data = text.encode("utf-8", "surrogatepass")
    kind, one, other = mutations[0]
    if kind % 16 == 15 and data:  # a file that has suffered
        place = one % len(data)
        data = data[:place] + bytes([other % 256]) + data[place + other % 3 :]
    return data


def _edit(text: str, kind: int, one: int, other: int) -> str:
    if kind < 5:
        lines = text.split("\n")
        first, second = one % len(lines), other % len(lines)
        if kind == 0:
            del lines[first]
        elif kind == 1:
            lines.insert(second, lines[first])
        elif kind == 2:
            lines[first], lines[second] = lines[second], lines[first]
        elif kind == 3:
            lines[first] = " " * (other % 9) + lines[first].strip()
        else:
            lines = lines[:first] + lines[first + other % 20 :]
        return "\n".join(lines)
    tokens = list(TOKEN.finditer(text))
    if not tokens:
        return text
    token = tokens[one % len(tokens)]
    start, end = token.span()
    if kind < 7:
        new = SPICE[other % len(SPICE)]
    elif kind == 7:
        new = tokens[other % len(tokens)][0]
    else:
        new = _misspelt(token[0], other)
    return text[:start] + new + text[end:]


def _misspelt(word: str, how: int) -> str:
    place, letter = how % (len(word) + 1), chr(97 + how % 26)
    return (
        word[:place] + letter + word[place:],
        word[:place] + word[place + 1 :],
        word[:place] + word[place : place + 2][::-1] + word[place + 2 :],
        word.swapcase(),
    )[how // 7 % 4]


# --- trees --------------------------------------------------------------------------------------------


def of_tree(plant: Seedling, mutations: list[Mutation]) -> bytes:
    """The file with keys and values dropped, doubled, renamed, swapped, or hostile."""
    tree = pickle.loads(plant.tree)
    for kind, one, other in mutations:
        places = list(_places(tree))
        if not places:
            break
        _CHANGES[kind % len(_CHANGES)](places, one, other, plant.words)
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: str = yaml.dump(tree, Dumper=dumper, sort_keys=False, allow_unicode=True, width=1_000)
    return text.encode("utf-8", "surrogatepass")


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Every place in the tree: the mapping or list, and the key or index."""
    found: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        holder = waiting.pop()
        for key, value in list(holder.items() if isinstance(holder, dict) else enumerate(holder)):
            found.append((holder, key))
            if isinstance(value, (dict, list)):
                waiting.append(value)
    return found


Places = list[tuple[Any, Any]]


def _drop(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    del holder[key]


def _double(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    if isinstance(holder, list):
        holder.insert(key, holder[key])
    else:
        holder[words[other % len(words)]] = holder[key]


def _rename(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    if isinstance(holder, dict):
        new = _misspelt(str(key), other) if other % 2 else words[other % len(words)]
        items = [(new if each == key else each, value) for each, value in holder.items()]
        holder.clear()
        holder.update(items)


def _retarget(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    texts = [(holder, key) for holder, key in places if isinstance(holder[key], str)]
    if texts:
        holder, key = texts[one % len(texts)]
        holder[key] = _misspelt(holder[key], other // 2) if other % 2 else words[other % len(words)]


def _swap(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    (holder, key), (second, place) = places[one % len(places)], places[other % len(places)]
    copied = pickle.loads(pickle.dumps(second[place]))  # not the thing itself: a tree has no rings
    second[place] = pickle.loads(pickle.dumps(holder[key]))
    holder[key] = copied


def _be_hostile(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    holder[key] = _hostile(other)


def _intrude(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    if isinstance(holder, list):
        holder.insert(key, _hostile(other))
    else:
        holder[words[(one + other) % len(words)]] = _hostile(other)


def _hostile(which: int) -> Any:
    value = HOSTILE[which % len(HOSTILE)]
    return pickle.loads(pickle.dumps(value)) if isinstance(value, (list, dict)) else value  # later mutations change it


def _wrap(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    holder, key = places[one % len(places)]
    for _ in range((1, 1, 2, 60, 150)[other % 5]):
        holder[key] = [holder[key]] if other % 2 else {words[other % len(words)]: holder[key]}


def _scale(places: Places, one: int, other: int, words: tuple[str, ...]) -> None:
    found = [(holder, key) for holder, key in places if type(holder[key]) in (int, float)]
    numbers = [(holder, key) for holder, key in found if abs(holder[key]) < 1e100]  # not beyond all floats
    if numbers:
        holder, key = numbers[one % len(numbers)]
        holder[key] = holder[key] * (-1, 0, 0.5, 2, 1e3, 1e9, 10**20, 1e-9)[other % 8]


Change = Callable[[Places, int, int, tuple[str, ...]], None]
_CHANGES: list[Change] = [
    _drop, _double, _rename, _retarget, _retarget, _swap, _be_hostile, _be_hostile, _intrude, _wrap, _scale,
]  # fmt: skip


# --- options ------------------------------------------------------------------------------------------


def of_options(plant: Seedling, mutations: list[Mutation]) -> dict[str, list[str]]:
    """Things to be set, added and taken out on the command line."""
    options: dict[str, list[str]] = {"set": [], "aspects": [], "without_aspects": []}
    words = plant.words
    for kind, one, other in mutations:
        word, value = words[one % len(words)], _flow(HOSTILE[other % len(HOSTILE)])
        if kind % 2:
            value = SPICE[other % len(SPICE)] + words[other % len(words)]
        if kind % 8 < 5:
            deeper = (word, f"*.{word}", f"**.{word}", f"{words[kind % len(words)]}[*].{word}", word + SPICE[one % 20])
            options["set"].append(f"{deeper[kind % 5]}{'' if other % 30 == 29 else '='}{value}")
        elif kind % 8 < 7:
            kinds = ("PacketLoss", "MeasurementFailure", "BurstLoss", "Latency", word)
            at = f",at={words[(one + other) % len(words)]}" if other % 3 else ""
            options["aspects"].append(f"{word}={kinds[one % 5]},probability={value}{at}")
        else:
            options["without_aspects"].append(_misspelt(word, other) if other % 2 else word)
    return options


def _flow(value: Any) -> str:
    if isinstance(value, str):
        return value
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: str = yaml.dump(value, Dumper=dumper, default_flow_style=True, width=10_000)
    return text.removesuffix("\n...\n").rstrip("\n")
