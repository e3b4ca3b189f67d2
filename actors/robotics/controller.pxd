# Types for C; what everything is for is said in controller.py.

from epicycle.actors.robotics.arrays cimport array_of, finite, joined, pair, read_only, stacked
