"""Puts the benchmark's driver on the path: it is a script with its package beside it, not an installed one."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "bench"))
