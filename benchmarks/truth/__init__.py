"""The truth board: models that others have published with results."""
