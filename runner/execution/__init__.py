"""How a model runs, and what a run leaves."""
