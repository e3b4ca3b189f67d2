# Types for C; what everything is for is said in world.py.

from epicycle.actors.robotics.arrays cimport all_finite, pair
