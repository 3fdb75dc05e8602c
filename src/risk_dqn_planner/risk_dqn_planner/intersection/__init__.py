# SPDX-License-Identifier: Apache-2.0
"""The intersection model: conflicting lanes, their zones, stop line and goal of a route."""
