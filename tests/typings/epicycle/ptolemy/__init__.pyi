from ptolemy import *
