"""The calls of a program, as they declare themselves; ``epicycle`` offers them, and commands are made from them."""
