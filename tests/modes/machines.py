"""Random machines: as a model file has them, as Python has them, and as the reference reads them."""

from __future__ import annotations

import random  # noqa: TID251 (what to try, and not what a model draws)
from typing import Any

from epicycle.actors import InputPort, ModalActor, OutputPort, ParameterError, StateMachine, transition
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.engine.errors import ActorError, LoopError
from tests.actors.feeding import model_of
from tests.modes.reference import interpret

UNTIL = 12
GUARDS = (
    "a > 2", "b == 1", "n > 3", "n % 2 == 0", "mode_time >= 1.5", "mode_time > 2", "a_is_present and b_is_present",
    "a > b", "not b_is_present", "n < 5 and a > 0", "b > 1 or n > 4", "mode_time < 3 and a_is_present",
)  # fmt: skip
ACTIONS = (("n", "n + 1"), ("n", "0"), ("x", "n"), ("x", "n * 2 + 1"), ("y", "n - 1"))


def random_machine(seed: int) -> tuple[dict[str, Any], list[tuple[int, str, int]]]:
    """A machine, and the tokens that it gets."""
    draw = random.Random(seed)
    modes = [f"m{number}" for number in range(draw.randint(2, 5))]
    final = [modes[-1]] if draw.random() < 0.2 else []
    open_modes = [mode for mode in modes if mode not in final]
    # A way through all modes, so that each can be entered, and more.
    ends = [([modes[number]], modes[number + 1]) for number in range(len(modes) - 1)]
    for _ in range(draw.randint(1, 5)):
        sources = ["*"] if draw.random() < 0.1 else draw.sample(open_modes, draw.randint(1, min(2, len(open_modes))))
        ends.append((sources, draw.choice(modes)))
    rules: list[dict[str, Any]] = []
    for place, (sources, target) in enumerate(ends):
        rule: dict[str, Any] = {"from": sources, "to": target}
        if draw.random() < 0.4:
            rule["on"] = draw.sample(["a", "b"], draw.randint(1, 2))
        if draw.random() < 0.4:
            rule["after"] = draw.choice([0, 500_000_000, 1_000_000_000, 2_500_000_000])
        if draw.random() < 0.5 or len(rule) == 2:
            rule["when"] = draw.choice(GUARDS)
        if draw.random() < 0.7:
            rule["do"] = [draw.choice(ACTIONS) for _ in range(draw.randint(1, 2))]
        rule["priority"] = place if draw.random() < 0.8 else 0
        for flag, share in (("else", 0.1), ("immediate", 0.2), ("nondeterministic", 0.3), ("preemptive", 0.15)):
            if draw.random() < share:
                rule[flag] = True
        rules.append(rule)
    if draw.random() < 0.3:
        for rule in rules:
            if draw.random() < 0.5:
                rule["probability"] = draw.choice([0.0, 0.25, 0.5, 1.0])
    events = [(draw.randint(0, 2 * UNTIL) * 500_000_000, draw.choice("ab"), draw.randint(0, 4)) for _ in range(25)]
    return {"modes": modes, "final": final, "variables": {"n": 0}, "transitions": rules}, sorted(events)


def as_text(rule: dict[str, Any]) -> str:
    """A transition in one line."""
    words = [f"{', '.join(rule['from'])} -> {rule['to']}"]
    words += [flag for flag in ("else", "immediate", "nondeterministic", "preemptive") if rule.get(flag)]
    words.append(f"priority {rule['priority']}")
    if "probability" in rule:
        words.append(f"probability {rule['probability']}")
    if "on" in rule:
        words.append(f"on {', '.join(rule['on'])}")
    if "after" in rule:
        words.append(f"after {rule['after']} ns")
    if "when" in rule:
        words.append(f"when {rule['when']}")
    if "do" in rule:
        words.append("do " + "; ".join(f"{name} = {value}" for name, value in rule["do"]))
    return " ".join(words)


def as_entry(machine: dict[str, Any], *, in_lines: bool = True) -> dict[str, Any]:
    """The machine as an actor of a model file."""
    transitions: list[Any] = [as_text(rule) for rule in machine["transitions"]]
    if not in_lines:
        transitions = [
            {**rule, "after": f"{rule['after']} ns"} if "after" in rule else dict(rule)
            for rule in machine["transitions"]
        ]
        for rule in transitions:
            rule["do"] = "; ".join(f"{name} = {value}" for name, value in rule.get("do", ()))
    modes = {mode: {"final": mode in machine["final"]} for mode in machine["modes"]}
    return {"type": "StateMachine", "modes": modes, "variables": machine["variables"], "transitions": transitions}


def as_class(machine: dict[str, Any]) -> type[ModalActor]:
    """The machine as a Python class."""

    def names(self: Any, *, alone: bool = False) -> dict[str, Any]:
        found = {"n": self.n, "mode_time": (self.context.time - self.entered) / 1e9}
        for port in ("a", "b"):
            found[f"{port}_is_present"] = port in self.tokens and not alone
            if port in self.tokens and not alone:
                found[port] = self.tokens[port]
        return found

    body: dict[str, Any] = {
        "modes": tuple(machine["modes"]),
        "final": tuple(machine["final"]),
        "a": InputPort(required=False, multi=True),
        "b": InputPort(required=False, multi=True),
        "x": OutputPort(float),
        "y": OutputPort(float),
    }

    def initialize(self: Any) -> None:
        ModalActor.initialize(self)
        self.n, self.entered, self.tokens, self.queues = 0, self.context.time, {}, {"a": [], "b": []}
        self.looks, self.seen, self.alone = [], -1, False

    def fire(self: Any) -> None:
        for port, queue in self.queues.items():
            queue.extend(self.inputs[port].tokens)
        self.tokens = {port: queue.pop(0) for port, queue in self.queues.items() if queue}
        looked = any(self.is_due(wake) for wake in self.looks)
        if self.tokens or self.is_called or looked:
            self.react()
        self.alone = True
        self.finish()
        self.alone, self.tokens = False, {}
        if any(self.queues.values()):
            self.wake_in(0)

    def enters(self: Any, mode: str) -> None:
        self.entered = self.context.time
        for wake in self.looks:
            wake.cancel()
        self.looks = []
        for rule in machine["transitions"]:
            for limit in ("1.5", "2", "3"):
                if (
                    f"mode_time >= {limit}" in rule.get("when", "")
                    or f"mode_time > {limit}" in rule.get("when", "")
                    or (f"mode_time < {limit}" in rule.get("when", ""))
                ) and (mode in rule["from"] or (rule["from"] == ["*"] and mode != rule["to"])):
                    self.looks.append(self.wake_in(float(limit)))

    body |= {"initialize": initialize, "fire": fire, "enters": enters}
    body["is_present"] = lambda self, port: port in self.tokens
    for place, rule in enumerate(machine["transitions"]):

        def act(self: Any, rule: dict[str, Any] = rule) -> None:
            for name, text in rule.get("do", ()):
                value = eval(text, {}, {"n": self.n})
                if name == "n":
                    self.n = value
                else:
                    self.outputs[name].send(value)

        def when(self: Any, rule: dict[str, Any] = rule) -> bool:
            try:
                return bool(
                    eval(
                        rule["when"].replace("time >", "time >=").replace(">==", ">="),
                        {},
                        names(self, alone=self.alone),
                    )
                )
            except NameError:
                return False

        body[f"rule_{place}"] = transition(
            rule["from"], rule["to"], on=rule.get("on", ()), when=when if "when" in rule else None,
            after=rule["after"] / 1e9 if "after" in rule else None, priority=rule["priority"],
            probability=rule.get("probability"), otherwise=rule.get("else", False),
            immediate=rule.get("immediate", False), nondeterministic=rule.get("nondeterministic", False),
            preemptive=rule.get("preemptive", False),
        )(act)  # fmt: skip
    return type("Modal", (ModalActor,), body)


def sends_of(
    entry: dict[str, Any], events: list[tuple[int, str, int]], types: list[type] | None = None
) -> list[tuple[int, int, str, Any]] | str:
    """What a machine sends in a run, or "error"."""
    inputs: dict[str, Any] = {
        port: [(time / 1e9, token) for time, name, token in events if name == port] for port in ("a", "b")
    }
    ports = entry.pop("ports", ("a", "b"))
    model = model_of(entry, {port: inputs[port] for port in ports}, types or [])
    model.stop = UNTIL
    simulation = Simulation(model, keep_log=True)
    try:
        results = simulation.run()
    except (ActorError, LoopError):
        return "error"
    return [
        (record.tag.time, record.tag.microstep, record.port, record.value)
        for record in results.log.records
        if record.actor == "it" and record.event == "send"
    ]


def disagreement(seed: int) -> dict[str, object] | None:
    """What the three make of a random machine, if it is not the same; None also for one that is refused."""
    machine, events = random_machine(seed)
    entry = as_entry(machine, in_lines=seed % 2 == 0)
    try:
        inputs = StateMachine("it", **{key: value for key, value in entry.items() if key != "type"}).inputs
    except ParameterError:
        return None
    events = [event for event in events if event[1] in inputs]
    wanted = interpret(machine, events, UNTIL * 10**9)
    if wanted == "endless":
        return None
    entry["ports"] = [port for port in ("a", "b") if port in inputs]
    found = {
        "reference": wanted,
        "model file": sends_of(entry, events),
        "Python": sends_of({"type": "Modal", "ports": ("a", "b")}, events, [as_class(machine)]),
    }
    return found if any(each != wanted for each in found.values()) else None
