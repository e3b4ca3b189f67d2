"""What to run: the conditions of a study, the identity of every run, and the columns of its table."""
