# SPDX-License-Identifier: Apache-2.0
"""Set up the workspace where something changed, then run a command in it.

    python3 tools/bootstrap.py                    set up
    python3 tools/bootstrap.py -- COMMAND ...     set up and run a command there

Standard library only, and written for Python 3.8 on, which need not be the Python that ROS uses.
"""

import sys

if sys.version_info < (3, 8):  # noqa: UP036, RUF100
    sys.exit(
        "error: Python 3.8 or newer is needed to start, but python3 here is {}.{}; install "
        "Python 3.10, 3.11 or 3.12 and pass it as HOST_PYTHON=/path/to/python.".format(
            *sys.version_info[:2]
        )
    )

from workspace.main import main

sys.exit(main(sys.argv[1:]))
