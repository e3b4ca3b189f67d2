"""Positioned text: YAML as nodes with positions, problems with places, and limits; it does not know the language."""
