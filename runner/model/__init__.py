"""How a text, or calls of a program, become a model."""
