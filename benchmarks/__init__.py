"""The benchmarks; `make bench` runs those that have a goal."""
