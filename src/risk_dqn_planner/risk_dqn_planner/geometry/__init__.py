# SPDX-License-Identifier: Apache-2.0
"""Polylines by arc length and vehicle footprints: the compiled geometry of the hot paths."""
