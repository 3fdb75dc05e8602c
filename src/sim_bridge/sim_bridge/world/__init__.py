# SPDX-License-Identifier: Apache-2.0
"""The fixed part of a simulation: lanes, obstacles and what follows from them."""
