"""Tests of properties over time."""
