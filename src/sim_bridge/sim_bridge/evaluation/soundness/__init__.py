# SPDX-License-Identifier: Apache-2.0
"""What the joint check promises, costs and rests on: `make evaluate SET=soundness`."""
