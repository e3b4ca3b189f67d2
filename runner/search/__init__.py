"""Searches over runs: one that breaks a property, what breaks it there, how rare that is, and what is best."""
