"""Making runs: which come next, in which processes, and the folder that keeps their results."""
