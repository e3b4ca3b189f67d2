"""The parts of native forms (``native.pyx``).  In Python there are none."""
