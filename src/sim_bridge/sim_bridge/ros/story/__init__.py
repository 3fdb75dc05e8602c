# SPDX-License-Identifier: Apache-2.0
"""The story of a bag: every change of decision, with its time and its reason."""
