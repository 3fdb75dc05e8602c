# SPDX-License-Identifier: Apache-2.0
"""Drives for hours and watches whether the nodes' memory stays flat and no decision is missing.

`trend` and `ledger` judge, in plain Python; `processes` reads what the system knows of a process,
`watch` what is said on the topics; `verdict` puts both together, `pictures` draws it, `command` is
the command line.
"""
