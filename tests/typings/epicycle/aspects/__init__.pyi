from aspects import *
