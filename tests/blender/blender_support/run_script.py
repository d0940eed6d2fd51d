"""Runs a script in Blender's own Python, and ends with it.

    python run_script.py SCRIPT [ARGUMENT]...

The package bpy 4.5 cannot be left to end by itself: where anything still holds its module when Python has ended, one of
its destructors waits for ever for a thread that nobody has told to stop.
"""

import os
import runpy
import sys
import traceback

sys.argv = sys.argv[1:]
code = 0
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
except BaseException:  # whatever it is, the caller is to read of it
    traceback.print_exc()
    code = 1
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
