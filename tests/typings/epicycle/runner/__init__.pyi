from runner import *
