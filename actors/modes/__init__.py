"""State machines: modes and the transitions between them, written as text or in Python."""

from .machine import StateMachine
from .modal import ModalActor, on_entry, on_exit, transition
from .text import Mode

__all__ = ["ModalActor", "Mode", "StateMachine", "on_entry", "on_exit", "transition"]
