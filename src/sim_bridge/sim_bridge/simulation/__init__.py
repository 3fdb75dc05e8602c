# SPDX-License-Identifier: Apache-2.0
"""Episodes that run: how they begin, how vehicles move, how they end."""
