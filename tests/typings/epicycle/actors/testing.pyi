from actors.testing import *
