"""From declarations, or a program, to a checked and frozen model."""
