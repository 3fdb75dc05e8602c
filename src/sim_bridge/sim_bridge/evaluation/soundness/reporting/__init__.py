# SPDX-License-Identifier: Apache-2.0
"""The page and the pictures of the set `soundness`."""
