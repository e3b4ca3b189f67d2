from bridges import *
