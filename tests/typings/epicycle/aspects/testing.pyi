from aspects.testing import *
