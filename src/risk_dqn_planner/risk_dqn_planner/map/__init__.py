# SPDX-License-Identifier: Apache-2.0
"""Lanelet2 maps: loading, and following a route on them."""
