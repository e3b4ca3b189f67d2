"""The tests: a package, so that no other one named ``tests`` hides what they share."""
