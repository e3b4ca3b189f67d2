"""What the runs of a study say: its table, estimates of every condition, verdicts on claims, and what to choose."""
