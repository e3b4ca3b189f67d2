"""A store of tokens, which Epicycle has no actor for."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort


class Dictionary(Actor):
    """Stores tokens by keys, which are texts, and sends them when asked.

    A key at ``write_key`` stores the token at ``value``, or forgets the key if none has come.  A key that is not stored
    gives null, and is sent by ``not_found``.  Writing comes before reading.  Ptolemy: ``Dictionary``.
    """

    write_key = InputPort(str, required=False, doc="the key of the token at 'value'")
    value: InputPort[Any] = InputPort(required=False, doc="the token to store")
    read_key = InputPort(str, required=False, doc="the key to look up")
    read_key_array: InputPort[list[str]] = InputPort(list, required=False, doc="several keys to look up")
    trigger_keys: InputPort[Any] = InputPort(required=False, doc="when to send all keys")
    result: OutputPort[Any] = OutputPort(doc="the token of 'read_key'")
    result_array: OutputPort[list[Any]] = OutputPort(list, doc="the tokens of 'read_key_array'")
    not_found: OutputPort[list[str]] = OutputPort(list, doc="the keys that are not stored")
    keys: OutputPort[list[str]] = OutputPort(list, doc="all keys, in the order in which they were first stored")

    def initialize(self) -> None:
        self._stored: dict[str, Any] = {}

    def fire(self) -> None:
        if self.write_key.present:
            if self.value.present and self.value.value is not None:
                self._stored[self.write_key.value] = self.value.value
            else:
                self._stored.pop(self.write_key.value, None)
        if self.read_key.present:
            self.result.send(self._stored.get(self.read_key.value))
            self._tell_missing([self.read_key.value])
        if self.read_key_array.present:
            self.result_array.send([self._stored.get(key) for key in self.read_key_array.value])
            self._tell_missing(self.read_key_array.value)
        if self.trigger_keys.present:
            self.keys.send([*self._stored])

    def _tell_missing(self, keys: list[str]) -> None:
        missing = [key for key in keys if key not in self._stored]
        if missing:
            self.not_found.send(missing)
