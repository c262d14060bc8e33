from ._frameless import *
