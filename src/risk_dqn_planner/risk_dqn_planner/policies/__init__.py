# SPDX-License-Identifier: Apache-2.0
"""Policies: Algorithm 1, trained networks and how they are stored, constant ones."""
