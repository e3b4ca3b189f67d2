"""Native forms of actors that compute with floats (``computing.pyx``).  In Python there are none."""
