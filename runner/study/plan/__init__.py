"""What is to be run: the conditions of a study, the identity of every run, and what the columns of its table are."""
