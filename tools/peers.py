# SPDX-License-Identifier: Apache-2.0
"""Make or mend the peers' environment, .venv-peers, then run a command in it.

    python tools/peers.py -- COMMAND ...

Run by the Python of .venv (`make bench` and `make shell` do), whose packages the new environment
sees. Where the peers cannot be installed, the command runs without them and finds the reason in
the variable PEERS_MISSING.
"""

import sys

from workspace.peers import main

sys.exit(main(sys.argv[1:]))
