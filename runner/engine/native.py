"""What native forms are made of (``native.pyx``).  In Python there are none."""
