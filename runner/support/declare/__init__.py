"""Calls as they declare themselves: a function's annotated parameters, and the options of a command made from them."""
