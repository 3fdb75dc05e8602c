# SPDX-License-Identifier: Apache-2.0
"""From the ego's pose, perceived objects and visible area to the paper's lane-based situation."""
