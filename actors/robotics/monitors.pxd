# Types for C; monitors.py documents everything.

from epicycle.actors.robotics.arrays cimport floats, pair
