# Types for C; world.py documents everything.

from epicycle.actors.robotics.arrays cimport all_finite, floats, pair
