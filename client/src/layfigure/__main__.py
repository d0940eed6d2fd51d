"""python -m layfigure: the command `layfigure`."""

import sys

from layfigure.cli.main import main

sys.exit(main())
