"""A store of tokens, which Epicycle has no actor for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.actors.expression import text_of


class Dictionary(Actor):
    """Stores tokens by keys, and sends them when asked.

    A key is any token, by its text.  One at ``write_key`` stores the token at ``value``, or forgets the key if none has
    come.  A key that is not stored gives null, and is sent by ``not_found``.  Writing comes before reading.
    Ptolemy: ``Dictionary``.
    """

    write_key: InputPort[Any] = InputPort(required=False, doc="the key of the token at 'value'")
    value: InputPort[Any] = InputPort(required=False, doc="the token to store")
    read_key: InputPort[Any] = InputPort(required=False, doc="the key to look up")
    read_key_array: InputPort[list[Any]] = InputPort(list, required=False, doc="several keys to look up")
    trigger_keys: InputPort[Any] = InputPort(required=False, doc="when to send all keys")
    result: OutputPort[Any] = OutputPort(doc="the token of 'read_key'")
    result_array: OutputPort[list[Any]] = OutputPort(list, doc="the tokens of 'read_key_array'")
    not_found: OutputPort[list[str]] = OutputPort(list, doc="the keys that are not stored")
    keys: OutputPort[list[str]] = OutputPort(list, doc="all keys, in the order in which they were first stored")

    def initialize(self) -> None:
        self._stored: dict[str, Any] = {}

    def fire(self) -> None:
        if self.write_key.present:
            key = text_of(self.write_key.value)
            if self.value.present and self.value.value is not None:
                self._stored[key] = self.value.value
            else:
                self._stored.pop(key, None)
        if self.read_key.present:
            self._look_up(self.result, [self.read_key.value], lambda found: found[0])
        if self.read_key_array.present:
            self._look_up(self.result_array, self.read_key_array.value, list)
        if self.trigger_keys.present:
            self.keys.send([*self._stored])

    def _look_up(self, port: OutputPort[Any], tokens: list[Any], made: Callable[[list[Any]], Any]) -> None:
        keys = [text_of(each) for each in tokens]
        port.send(made([self._stored.get(key) for key in keys]))
        if missing := [key for key in keys if key not in self._stored]:
            self.not_found.send(missing)
