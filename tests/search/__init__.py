"""Tests of searches over runs."""
