# SPDX-License-Identifier: Apache-2.0
"""Policies measured against each other, against the paper, and against what is possible."""
