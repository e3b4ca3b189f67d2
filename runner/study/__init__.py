"""Studies: many runs of a model under many conditions, whose results survive any interruption.

``plan`` determines the runs, ``run`` makes them and keeps their results, ``judge`` evaluates these."""
