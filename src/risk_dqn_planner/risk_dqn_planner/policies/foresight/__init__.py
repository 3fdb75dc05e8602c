# SPDX-License-Identifier: Apache-2.0
"""What the look-ahead policy expects of the next seconds, and its search through them."""
