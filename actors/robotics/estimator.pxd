# Types for C; what everything is for is said in estimator.py.

from epicycle.actors.robotics.arrays cimport array_of, pair, stacked
