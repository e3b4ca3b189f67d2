"""What a state machine is, once more and as plainly as can be: an interpreter to compare machines with.

A machine is a dict: ``modes``, ``final``, ``variables``, ``transitions``; each of these is a dict as a model file has
it, with whole ns in ``after`` and conditions that Python reads.  Time is in ns.  One that is ``as_in_ptolemy`` takes
tokens that come together at one tag, sets variables last, and reacts again behind each transition.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from epicycle.actors import random_stream

Send = tuple[int, int, str, Any]
Tag = tuple[int, int]


def interpret(machine: Mapping[str, Any], events: list[tuple[int, str, Any]], until: int) -> list[Send] | str:
    """What a machine sends up to a time; "error" if two transitions are enabled at once, "endless" if time stands."""
    sends: list[Send] = []
    queues: dict[str, list[Any]] = {}
    stream, chance = random_stream(0, "it", ""), random_stream(0, "it", "probability")
    as_in_ptolemy = machine.get("as_in_ptolemy", False)
    lot, used, drawn = None, 0.0, dict[int, bool]()
    known = dict(machine["variables"])
    mode, entered, is_begun = machine["modes"][0], 0, False
    timers: dict[int, Tag] = {}
    deadlines: set[int] = set()
    calls: set[Tag] = {(0, 1)}  # the tags at which it reacts without a token
    rest: set[Tag] = set()  # the tags at which tokens are left over
    rules = list(enumerate(machine["transitions"]))

    def leaving(immediate: bool = False) -> list[tuple[int, Mapping[str, Any]]]:
        found = [(number, rule) for number, rule in rules if mode in rule["from"]]
        found += [(number, rule) for number, rule in rules if rule["from"] == ["*"] and mode != rule["to"]]
        found = [] if mode in machine["final"] else sorted(found)
        return [each for each in found if each[1].get("immediate")] if immediate else found

    def true(text: str, tokens: Mapping[str, Any]) -> bool:
        # What waits for a time changes when it has come, whatever becomes of equality.
        text = re.sub(r"(mode_time [<>])=?", lambda found: found[1] + ("=" if ">" in found[1] else ""), text)
        names = {**known, **tokens, "mode_time": (now[0] - entered) / 1e9, "time": now[0] / 1e9}
        names |= {f"{port}_is_present": port in tokens for port in ("a", "b")}
        try:
            return bool(eval(text, {"__builtins__": {}}, names))
        except NameError:
            return False

    def is_open(number: int, rule: Mapping[str, Any]) -> bool:
        return "after" not in rule or (number in timers and timers[number] <= now)

    def enabled(number: int, rule: Mapping[str, Any], tokens: Mapping[str, Any]) -> bool:
        if "on" in rule and not any(port in tokens for port in rule["on"]):
            return False
        return is_open(number, rule) and true(rule.get("when", "True"), tokens) and likely(number, rule)

    def likely(place: int, rule: Mapping[str, Any]) -> bool:
        nonlocal lot, used
        if "probability" in rule and place not in drawn:
            if lot is None:
                lot, used = chance.random(), 0.0
            if used + rule["probability"] > 1:
                raise ValueError
            drawn[place] = used <= lot < used + rule["probability"]
            used += rule["probability"]
        return drawn.get(place, True)

    def choose(among: list[tuple[int, Mapping[str, Any]]], tokens: Mapping[str, Any]) -> Mapping[str, Any] | None:
        for otherwise in (False, True):
            found = [
                rule for number, rule in among if rule.get("else", False) is otherwise and enabled(number, rule, tokens)
            ]
            if found:
                least = min(rule.get("priority", 0) for rule in found)
                found = [rule for rule in found if rule.get("priority", 0) == least]
                if len(found) > 1 and not all(rule.get("nondeterministic") for rule in found):
                    raise ValueError
                return found[stream.below(len(found))] if len(found) > 1 else found[0]
        return None

    def enter(target: str) -> None:
        nonlocal mode, entered, timers, deadlines, lot
        mode, entered, timers, deadlines, lot = target, now[0], {}, set(), None
        drawn.clear()
        for number, rule in leaving():
            if "after" in rule:
                timers[number] = (now[0] + rule["after"], 1) if rule["after"] else (now[0], now[1] + 1)
            deadlines |= {
                entered + round(float(x) * 1e9) for x in re.findall(r"mode_time [<>]=? ([\d.]+)", rule.get("when", ""))
            }

    def follow(rule: Mapping[str, Any] | None, tokens: Mapping[str, Any]) -> bool:
        taken, to_set = 0, list[tuple[str, str]]()
        while rule is not None:
            taken += 1
            if taken > 1000:
                raise ValueError
            for target, text in rule.get("do", ()):
                if target not in known:
                    sends.append((*now, target, eval(text, {"__builtins__": {}}, {**known, **tokens})))
                elif as_in_ptolemy:
                    to_set.append((target, text))
                else:
                    known[target] = eval(text, {"__builtins__": {}}, {**known, **tokens})
            enter(rule["to"])
            rule = choose(leaving(immediate=True), tokens)
        for target, text in to_set:
            known[target] = eval(text, {"__builtins__": {}}, {**known, **tokens})
        return taken > 0

    by_time: dict[int, list[tuple[str, Any]]] = {}
    for time, port, token in events:
        by_time.setdefault(time, []).append((port, token))
    now: Tag = (0, 0)
    while True:
        coming = [
            tag
            for tag in ({(time, 1) for time in (*by_time, *deadlines)} | calls | rest | {*timers.values()})
            if tag > now
        ]
        if not coming or min(coming)[0] > until:
            return sends
        seen, now = now, min(coming)
        if now[1] > 50:
            return "endless"
        for port, token in by_time.get(now[0], ()) if now[1] == 1 else ():
            queues.setdefault(port, []).append(token)
        is_called = now in calls or now in timers.values() or any(seen[0] < time <= now[0] for time in deadlines)
        is_first = True
        while is_first or (as_in_ptolemy and any(queues.values())):
            tokens = {port: queue.pop(0) for port, queue in queues.items() if queue}
            is_new, has_moved = not is_begun, False
            drawn.clear()
            lot = None
            try:
                if is_new:
                    is_begun = True
                    enter(mode)
                    if as_in_ptolemy:
                        follow(choose(leaving(immediate=True), tokens), tokens)
                if (is_called and is_first) or tokens:
                    early = [each for each in leaving() if each[1].get("preemptive")]
                    late = [each for each in leaving() if not each[1].get("preemptive")]
                    has_moved = follow(choose(early, tokens) or choose(late, tokens), tokens)
                    is_new = is_new or has_moved
            except ValueError:
                return "error"
            is_first = False
            if is_new:
                sends.append((*now, "mode", mode))
                alone = [(n, rule) for n, rule in leaving() if not rule.get("else") and "on" not in rule]
                goes_on = any(is_open(n, rule) and true(rule.get("when", "True"), {}) for n, rule in alone)
                if (has_moved and mode not in machine["final"]) if as_in_ptolemy else goes_on:
                    calls.add((now[0], now[1] + 1))
        if any(queues.values()):
            rest.add((now[0], now[1] + 1))
