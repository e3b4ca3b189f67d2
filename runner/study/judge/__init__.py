"""What the runs of a study show: its table, estimates for every condition, verdicts on claims, and what to choose."""
