"""Agents: a server of the Model Context Protocol, whose tools are the commands, in processes with limits."""

from .limited import LimitedCall

__all__ = ["LimitedCall"]
