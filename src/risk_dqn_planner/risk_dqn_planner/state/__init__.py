# SPDX-License-Identifier: Apache-2.0
"""State of the network: the last five scenes, selected and normalised."""
