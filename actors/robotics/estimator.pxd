# Types for C; estimator.py documents everything.

from epicycle.actors.robotics.arrays cimport array_of, floats, stacked
