# SPDX-License-Identifier: Apache-2.0
"""Scenario files of the package; each is documented by its own `description`."""
