from ptolemy.importing import *
