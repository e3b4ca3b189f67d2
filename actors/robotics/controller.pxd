# Types for C; controller.py documents everything.

from epicycle.actors.robotics.arrays cimport array_of, finite, floats, joined, read_only, stacked
